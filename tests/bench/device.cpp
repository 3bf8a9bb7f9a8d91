// farfeel-bench device: see device_main.cpp, the program that it runs.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "tests/bench/bench.h"

namespace farfeel::bench {

void add_device(CLI::App& bench) {
  CLI::App* const app = bench.add_subcommand(
      "device", "What a device costs a haptic tick, and how old its sample is then, on emulated hardware");
  app->prefix_command();
  app->callback([app] {
    const std::string program =
        std::filesystem::read_symlink("/proc/self/exe").replace_filename("farfeel-bench-device").string();
    std::vector<std::string> words = app->remaining();
    std::vector<char*> arguments{const_cast<char*>(program.c_str())};
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    ::execv(program.c_str(), arguments.data());
    fmt::print(stderr, "could not start {}: {}; it is built where umockdev is: apt install libumockdev-dev umockdev\n",
               program, std::strerror(errno));
    throw CLI::RuntimeError(1);
  });
}

}  // namespace farfeel::bench
