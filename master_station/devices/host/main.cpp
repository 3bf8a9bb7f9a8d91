// farfeel-device: owns the hardware at the operator's hand. All the wiring is here.
#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <span>

#include "master_station/devices/host/keeper.h"
#include "master_station/devices/host/owner.h"

namespace farfeel::devices {
namespace {

constexpr const char* kAbout = R"(farfeel-device: owns the haptic device at the operator's hand.

farfeel-master starts 'farfeel-device serve' by itself, and 'farfeel device ...' runs the other commands.)";

struct Arguments {
  int link_fd = -1, station = -1;
  std::string device = "auto";
  DriverOptions options;
};

std::atomic<bool> stop_asked{false};

void ask_to_stop(int) {
  stop_asked = true;
}

int serve(const Arguments& arguments) {
  // The station may be gone before this line; its death later ends this program in order, too.
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (arguments.station >= 0 && getppid() != arguments.station) return 0;
  std::signal(SIGTERM, ask_to_stop);
  std::signal(SIGINT, ask_to_stop);
  std::signal(SIGPIPE, SIG_IGN);
  auto link = MappedLink::open(arguments.link_fd);
  if (!link) {
    spdlog::error("{}", link.error());
    return 1;
  }
  Owner owner(link->memory(), link->fd(), driver_families(), parse_wanted(arguments.device), arguments.options);
  owner.run(stop_asked);
  return 0;
}

}  // namespace
}  // namespace farfeel::devices

int main(int argc, char** argv) {
  using namespace farfeel::devices;
  if (const auto kept = keep_if_asked(std::span(argv, static_cast<std::size_t>(argc)))) return *kept;
  Arguments arguments;
  CLI::App app{kAbout, "farfeel-device"};
  app.require_subcommand(1);
  CLI::App* const served = app.add_subcommand("serve", "Drives a device for the station that started this program");
  served->add_option("--link-fd", arguments.link_fd, "Descriptor of the memory shared with the station")->required();
  served->add_option("--station", arguments.station, "Process number of the station, whose end is this program's");
  served->add_option("--device", arguments.device, "auto, or NAME[:SERIAL]")->capture_default_str();
  served->add_option("--firmware", arguments.options.firmware, "File with a Falcon's firmware");
  served->add_option("--plug-in", arguments.options.plug_in, "Shared library with the interface farfeel_device_v1");
  CLI11_PARSE(app, argc, argv);
  spdlog::set_default_logger(spdlog::stderr_color_mt("device"));
  spdlog::set_pattern("%H:%M:%S.%e %n: %^%v%$");
  return serve(arguments);
}
