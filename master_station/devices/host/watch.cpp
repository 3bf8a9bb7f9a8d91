#include <fmt/format.h>

#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/host/commands.h"
#include "master_station/devices/host/owner_thread.h"
#include "master_station/devices/host/terminal.h"
#include "master_station/devices/host/watched.h"

namespace farfeel::devices {
namespace {

constexpr std::int64_t kDraw_ns = 100'000'000, kLine_ns = 1'000'000'000;
constexpr std::int64_t kLook_ns = 20'000'000;  // for Ctrl-C
constexpr double kRateWindow_s = 1;

}  // namespace

int watch(const Hardware& hardware) {
  const std::atomic<bool>& must_end = asked_to_end();
  auto owner = OwnerThread::start(hardware.families, parse_wanted(hardware.device), hardware.options);
  if (!owner) {
    fmt::print(stderr, "farfeel-device: {}\n", owner.error());
    return 1;
  }
  Terminal terminal;
  if (terminal.has_screen()) terminal.say("Force stays off. Ctrl-C ends.");
  std::int64_t counted_ns = realtime::monotonic_now_ns();
  Sample counted;
  Watched watched;
  for (std::int64_t next_ns = 0; !must_end;) {
    const std::int64_t now_ns = realtime::wait_until(realtime::monotonic_now_ns() + kLook_ns, 0);
    if (now_ns < next_ns) continue;
    next_ns = now_ns + (terminal.has_screen() ? kDraw_ns : kLine_ns);
    watched.sample = (*owner)->sample();
    const OpenedDevice opened = (*owner)->opened();
    watched.name = watched.sample.stage == Stage::kAbsent
                       ? hardware.device
                       : fmt::format("{}:{}", opened.model.text(), opened.serial.text());
    watched.advice = (*owner)->advice();
    watched.age_ms = watched.sample.time_ns == 0 ? 0 : static_cast<double>(now_ns - watched.sample.time_ns) * 1e-6;
    watched.exchange_ms = static_cast<double>((*owner)->memory().step_ns.load(std::memory_order_relaxed)) * 1e-6;
    if (const double past_s = static_cast<double>(now_ns - counted_ns) * 1e-9;
        past_s >= kRateWindow_s || watched.sample.reports < counted.reports) {
      watched.reports_Hz = watched.sample.reports < counted.reports
                               ? 0
                               : static_cast<double>(watched.sample.reports - counted.reports) / past_s;
      counted = watched.sample;
      counted_ns = now_ns;
    }
    if (terminal.has_screen()) {
      terminal.draw(picture(watched));
    } else {
      terminal.say(line(watched));
    }
  }
  return 0;
}

}  // namespace farfeel::devices
