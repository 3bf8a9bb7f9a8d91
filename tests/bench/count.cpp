// farfeel-bench count: see count_main.cpp, the program that it runs.
#include <CLI/CLI.hpp>

#include "tests/bench/bench.h"
#include "tests/bench/program_beside.h"

namespace farfeel::bench {

void add_count(CLI::App& bench) {
  CLI::App* const app = bench.add_subcommand("count", "How much work is done along frozen motions");
  app->set_help_flag();  // the program has the help
  app->prefix_command();
  app->callback([app] {
    become_program_beside("farfeel-bench-count", app->remaining());
    throw CLI::RuntimeError(1);
  });
}

}  // namespace farfeel::bench
