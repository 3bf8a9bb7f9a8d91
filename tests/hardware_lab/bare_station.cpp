#include "tests/hardware_lab/bare_station.h"

#include <fmt/format.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "master_station/devices/link/owner_process.h"
#include "tests/hardware_lab/usb_gadget.h"

namespace farfeel::hardware_lab {
namespace {

volatile std::sig_atomic_t is_asked_to_end = 0;
constexpr double kEach_N = 0.5;  // along each axis: some devices have two

}  // namespace

int run_bare_station(const std::vector<std::string>& arguments) {
  std::signal(SIGTERM, [](int) { is_asked_to_end = 1; });
  auto owner = devices::OwnerProcess::start({.program = "/bin/farfeel-device", .arguments = arguments});
  if (!owner) {
    fmt::print(stderr, "{}\n", owner.error());
    return 1;
  }
  std::string told;
  while (is_asked_to_end == 0) {
    const devices::Sample sample = owner->newest();
    devices::Command command;
    command.time_ns = now_ns();
    command.opening = sample.opening;
    command.is_light_on = true;
    command.is_force_on =
        sample.stage == devices::Stage::kReady && command.time_ns - sample.polled_ns < devices::kStaleSample_ns;
    if (command.is_force_on) command.F_hand_B.force_N = {kEach_N, kEach_N, kEach_N};
    owner->memory().command.store(command);
    const std::string line = fmt::format("{} {}", devices::name(sample.stage), owner->advice());
    if (line != told) fmt::print("{} ms: {}\n", command.time_ns / 1'000'000, line), std::fflush(stdout);
    told = line;
    if (const std::string news = owner->look(command.time_ns); !news.empty()) fmt::print("{}\n", news);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return 0;
}

}  // namespace farfeel::hardware_lab
