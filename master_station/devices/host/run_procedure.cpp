#include "master_station/devices/host/run_procedure.h"

#include <fmt/format.h>

#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/host/held_force.h"
#include "master_station/devices/host/owner_thread.h"
#include "master_station/devices/host/terminal.h"
#include "master_station/station_key.h"

namespace farfeel::devices {
namespace {

constexpr std::int64_t kTick_ns = 1'000'000;
constexpr int kPriority = 40;  // below the owner's
constexpr std::size_t kLineMax = 200;

/// What is typed, as lines and as a key that is held.
class Typing {
 public:
  void take(Terminal& terminal, std::int64_t now_ns) {
    while (const std::optional<char> key = terminal.key()) {
      if (*key == ' ') hold_.came(now_ns);
      if (*key == '\b' || *key == '\x7f') {
        if (!line_.empty()) line_.pop_back();
      } else if (*key == '\n') {
        lines_.push_back(std::exchange(line_, {}));
      } else if (line_.size() < kLineMax) {
        line_ += *key;
      }
    }
  }
  [[nodiscard]] std::optional<std::string> next_line() {
    if (lines_.empty()) return std::nullopt;
    std::string line = lines_.front();
    lines_.erase(lines_.begin());
    const std::size_t begin = line.find_first_not_of(' ');  // spaces may have come from holding the bar
    return begin == std::string::npos ? std::string() : line.substr(begin);
  }
  [[nodiscard]] bool has_lines() const { return !lines_.empty(); }
  [[nodiscard]] bool is_key_held(std::int64_t now_ns) const { return now_ns < hold_.until_ns(); }

 private:
  master_station::HeldKey hold_;
  std::string line_;
  std::vector<std::string> lines_;
};

tl::expected<OpenedFigures, ModelError> figures_of(const OpenedDevice& opened, ModelLookup lookup) {
  OpenedFigures figures;
  if (const DeviceModel* const known = lookup(opened.model.text())) {
    figures.model = *known;
    figures.has_data = true;
  }
  figures.model.name = opened.model.text();
  if (const std::string own = opened.model_toml.text(); !own.empty()) {
    auto model = parse_model(own, "what the device says of itself", figures.model);
    if (!model) return tl::unexpected(model.error());
    figures.model = *std::move(model);
    figures.has_data = true;
  }
  auto folder = device_folder();
  if (!folder) return tl::unexpected(folder.error());
  figures.path = *folder + "/" + device_file_name(opened.model.text(), opened.serial.text());
  auto file = read_device_file(figures.path, figures.model);
  if (!file) return tl::unexpected(file.error());
  figures.file = *std::move(file);
  return figures;
}

}  // namespace

int run_procedure(const Hardware& hardware,
                  const std::function<std::unique_ptr<Procedure>(const OpenedFigures&, RunSettings&)>& make) {
  const std::atomic<bool>& must_end = asked_to_end();
  auto owner = OwnerThread::start(hardware.families, parse_wanted(hardware.device), hardware.options);
  if (!owner) {
    fmt::print(stderr, "farfeel-device: {}\n", owner.error());
    return 1;
  }
  LinkMemory& memory = (*owner)->memory();
  Terminal terminal;
  Typing typing;
  std::string advice;
  const auto tell_advice = [&] {
    if (std::string now = (*owner)->advice(); now != advice) {
      advice = std::move(now);
      if (!advice.empty()) terminal.say(advice);
    }
  };
  while (!must_end && (*owner)->sample().stage != Stage::kReady) {
    tell_advice();
    realtime::wait_until(realtime::monotonic_now_ns() + 20 * kTick_ns, 0);
  }
  if (must_end) return 1;
  auto figures = figures_of((*owner)->opened(), hardware.lookup);
  if (!figures) {
    fmt::print(stderr, "farfeel-device: {}\n", figures.error().message);
    return 1;
  }
  RunSettings settings;
  const std::unique_ptr<Procedure> procedure = make(*figures, settings);
  if (!procedure) return 1;
  HeldForce held(figures->file.model, settings.cap_N);
  const Calibration calibration = settings.applies_calibration ? figures->file.calibration : Calibration{};

  realtime::use_fifo(kPriority);
  realtime::Deadlines deadlines(realtime::monotonic_now_ns(), kTick_ns);
  Command none;
  while (!must_end) {
    const std::int64_t now_ns = realtime::wait_until(deadlines.current_ns(), 0);
    const Sample in_A = (*owner)->sample();
    typing.take(terminal, now_ns);
    const bool is_held = held.next(now_ns, in_A, typing.is_key_held(now_ns));
    Turn turn;
    if (in_A.stage == Stage::kReady) {
      turn = procedure->step(now_ns, calibrated(calibration, in_A), {typing.next_line(), is_held});
    } else {
      tell_advice();
    }
    spatial::Wrench F_B;
    F_B.force_N = turn.force_N;
    memory.command.store(held.command(now_ns, for_device(calibration, F_B).force_N));
    for (const std::string& line : turn.say) terminal.say(line);
    if (turn.is_over) break;
    const bool waits_for_keys = turn.waits_for == WaitsFor::kLine ||
                                (turn.waits_for == WaitsFor::kHold && figures->file.model.enable_button < 0);
    if (terminal.has_ended() && !typing.has_lines() && waits_for_keys) {
      terminal.say("Nobody types any more: it ends here.");
      break;
    }
    deadlines.advance(realtime::monotonic_now_ns());
  }
  none.time_ns = realtime::monotonic_now_ns();
  memory.command.store(none);
  return procedure->status();
}

}  // namespace farfeel::devices
