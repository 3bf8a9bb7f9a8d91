// In the guest of deploy/hardware-lab: emulated devices, and the stations that feel through them.
#include <fmt/format.h>
#include <sched.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <map>

#include "tests/hardware_lab/bare_station.h"
#include "tests/hardware_lab/drill.h"

namespace {

using namespace farfeel::hardware_lab;

constexpr int kHardwarePriority = 60;  // before every program: emulated hardware does not wait for them

const std::map<std::string, std::unique_ptr<LabDevice> (*)()> kDevices{{"spacemouse", make_space_mouse},
                                                                       {"falcon", make_falcon},
                                                                       {"wooden-haptics", make_wooden_haptics},
                                                                       {"inverse3", make_inverse3},
                                                                       {"pid-joystick", make_joystick}};

/// Lines for the host: "tell WORDS", "row JSON".
void to_host(std::FILE* host, const std::string& line) {
  fmt::print(host, "{}\n", line);
  std::fflush(host);
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string(argv[1]) == "station") return run_bare_station({argv + 2, argv + argc});
  CLI::App app{"Emulated devices behind this kernel's own USB and HID stacks; in deploy/hardware-lab's guest alone"};
  std::vector<std::string> wanted;
  DrillSettings settings;
  std::string host_path = "/dev/ttyS1";
  app.add_option("--device", wanted, "That one alone; may be given again");
  app.add_option("--unplugs", settings.unplugs, "How often each is pulled out")->capture_default_str();
  app.add_flag("--bare", settings.is_bare, "A station without haptics in the master's place");
  app.add_option("--host", host_path, "File for lines to the host")->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  sched_param priority{};
  priority.sched_priority = kHardwarePriority;
  sched_setscheduler(0, SCHED_FIFO, &priority);
  std::FILE* const host = std::fopen(host_path.c_str(), "a");
  if (host == nullptr) return 1;
  for (const auto& [name, make] : kDevices) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), name) == wanted.end()) continue;
    const auto device = make();
    const Row row =
        drill(*device, settings, [&](const std::string& words) { to_host(host, "tell " + name + ": " + words); });
    to_host(host, "row " + json(row));
  }
  return 0;
}
