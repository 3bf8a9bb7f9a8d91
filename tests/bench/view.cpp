// farfeel-bench view: see view_main.cpp, the program that it runs.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "tests/bench/bench.h"
#include "tests/bench/program_beside.h"

namespace farfeel::bench {

void add_view(CLI::App& bench) {
  CLI::App* const app = bench.add_subcommand(
      "view", "How fresh the live view is, also after a stall, and what it costs, by a client that draws nothing");
  app->prefix_command();
  app->callback([app] {
    become_program_beside("farfeel-bench-view", app->remaining());
    throw CLI::RuntimeError(1);
  });
}

}  // namespace farfeel::bench
