// farfeel-bench device: see device_main.cpp, the program that it runs.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "tests/bench/bench.h"
#include "tests/bench/program_beside.h"

namespace farfeel::bench {

void add_device(CLI::App& bench) {
  CLI::App* const app = bench.add_subcommand(
      "device", "What a device costs a haptic tick, and how old its sample is then, on emulated hardware");
  app->prefix_command();
  app->callback([app] {
    become_program_beside("farfeel-bench-device", app->remaining());
    fmt::print(stderr, "it is built where umockdev is: apt-get update && apt-get install libumockdev-dev umockdev\n");
    throw CLI::RuntimeError(1);
  });
}

}  // namespace farfeel::bench
