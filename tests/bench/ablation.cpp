// farfeel-bench ablation: see ablation_main.cpp, the program that it runs.
#include <CLI/CLI.hpp>

#include "tests/bench/bench.h"
#include "tests/bench/program_beside.h"

namespace farfeel::bench {

void add_ablation(CLI::App& bench) {
  CLI::App* const app = bench.add_subcommand("ablation", "What fails, and what it costs, without each mechanism");
  app->set_help_flag();  // the program has the help
  app->prefix_command();
  app->callback([app] {
    become_program_beside("farfeel-bench-ablation", app->remaining());
    throw CLI::RuntimeError(1);
  });
}

}  // namespace farfeel::bench
