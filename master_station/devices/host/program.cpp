#include "master_station/devices/host/program.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>

#include "codecs/settings/command_line.h"
#include "codecs/settings/log.h"
#include "master_station/devices/host/commands.h"
#include "master_station/devices/host/keeper.h"
#include "master_station/devices/host/owner.h"

namespace farfeel::devices {
namespace {

constexpr const char* kAbout = R"(farfeel-device: owns the haptic device at the operator's hand.

farfeel-master starts 'farfeel-device serve' by itself, and 'farfeel device ...' runs the other commands.)";

std::atomic<bool> stop_asked{false};

void ask_to_stop(int) {
  stop_asked = true;
}

struct Station {
  int link_fd = -1, process = -1;
};

int serve(const Hardware& hardware, const Station& station) {
  // The station may be gone before this line; its death later ends this program in order, too.
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (station.process >= 0 && getppid() != station.process) return 0;
  std::signal(SIGTERM, ask_to_stop);
  std::signal(SIGINT, ask_to_stop);
  std::signal(SIGPIPE, SIG_IGN);
  auto link = MappedLink::open(station.link_fd);
  if (!link) {
    spdlog::error("{}", link.error());
    return 1;
  }
  Owner owner(link->memory(), link->fd(), hardware.families, parse_wanted(hardware.device), hardware.options);
  owner.run(stop_asked);
  return 0;
}

/// What every command that looks for hardware takes.
CLI::App* command(CLI::App& app, const char* name, const char* about, Hardware& hardware) {
  CLI::App* const added = app.add_subcommand(name, about);
  added->add_option("--firmware", hardware.options.firmware, "File with a Falcon's firmware");
  added->add_option("--plug-in", hardware.options.plug_in, "Shared library with the interface farfeel_device_v1");
  return added;
}

}  // namespace

int run_program(int argc, char** argv, std::span<const DriverFamily> families, ModelLookup lookup) {
  if (const auto kept = keep_if_asked(std::span(argv, static_cast<std::size_t>(argc)))) return *kept;
  Hardware hardware{families, lookup, {}};
  Station station;
  CLI::App app{kAbout, "farfeel-device"};
  app.require_subcommand(1);

  CLI::App* const served = command(app, "serve", "Drives a device for the station that started this program", hardware);
  served->add_option("--link-fd", station.link_fd, "Descriptor of the memory shared with the station")
      ->required()
      ->configurable(false);
  served->add_option("--station", station.process, "Process number of the station, whose end is this program's")
      ->configurable(false);
  served->add_option("--device", hardware.device, "auto, or NAME[:SERIAL]")->capture_default_str();

  CLI::App* const listed = command(app, "list", "Every device that is plugged in, and what it can", hardware);
  bool is_json = false, is_for_station = false;
  CLI::Option* const as_json = listed->add_flag("--json", is_json, "As JSON");
  listed->add_flag("--machine", is_for_station, "For the station: lines of fields apart by tabs")
      ->excludes(as_json)
      ->configurable(false);

  CLI::App* const watched =
      command(app, "watch", "What a device says, live; force stays off, and Ctrl-C ends it", hardware);
  watched->add_option("device", hardware.device, "auto, or NAME[:SERIAL]")->capture_default_str();

  bool has_consent = false;
  const auto with_person = [&](const char* name, const char* about) {
    CLI::App* const added = command(app, name, about, hardware);
    added->add_option("device", hardware.device, "auto, or NAME[:SERIAL]")->capture_default_str();
    return added;
  };
  CLI::App* const tested = with_person("test", "Whether the handle tells where it goes, and pushes where it says");
  tested->add_flag("--yes", has_consent, "I consent to weak forces")->configurable(false);
  CLI::App* const calibrated =
      with_person("calibrate", "Axes, middle, weight and newtons, kept for this serial number");
  CLI::App* const identified =
      with_person("identify-limits", "The stiffest calm coupling of this device, kept for this serial number");
  identified->add_flag("--yes", has_consent, "I consent to kicks of 2 N")->configurable(false);

  if (const auto done = codecs::parse_command_line(app, argc, argv)) return *done;
  codecs::log_as("device");
  if (*served) return serve(hardware, station);
  // Nobody plugs in what has no such name: it would be waited for for ever.
  if (const std::string trouble = trouble_with_name(hardware.device, families, hardware.options); !trouble.empty()) {
    fmt::print(stderr, "farfeel-device: {}\n", trouble);
    return codecs::kUsageError;
  }
  if (*watched) return watch(hardware);
  if (*tested) return test(hardware, has_consent);
  if (*calibrated) return calibrate(hardware);
  if (*identified) return identify_limits(hardware, has_consent);
  return list(hardware, is_json ? ListForm::kJson : is_for_station ? ListForm::kForStation : ListForm::kForPerson);
}

}  // namespace farfeel::devices
