#include "master_station/devices/host/owner.h"

#include <fmt/format.h>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::devices {
namespace {

constexpr int kPriority = 45;  // above the haptic loop's: what it wrote has to go out in its own tick

}  // namespace

bool WantedDevice::matches(const FoundDevice& found, std::string_view family) const {
  const bool is_named = name == "auto" || name == found.model || name == family;
  return is_named && (serial.empty() || serial == found.serial);
}

WantedDevice parse_wanted(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return {std::string(text), {}};
  return {std::string(text.substr(0, colon)), std::string(text.substr(colon + 1))};
}

Owner::Owner(LinkMemory& memory, int link_fd, std::span<const DriverFamily> families, WantedDevice wanted,
             DriverOptions options)
    : memory_(memory),
      link_fd_(link_fd),
      families_(families),
      wanted_(std::move(wanted)),
      options_(std::move(options)) {
  // An owner before this one may have told of openings: this one's are later.
  if (Sample before; memory_.sample.load(before)) sample_.opening = before.opening;
}

Owner::~Owner() {
  close();
}

void Owner::tell(Stage stage, std::string_view advice) {
  sample_.stage = stage;
  memory_.sample.store(sample_);
  if (advice == told_) return;
  told_ = advice;
  FixedText<512> text;
  text = advice;
  memory_.advice.store(text);
}

void Owner::begin_opening() {
  ++sample_.opening;
  OpenedDevice opened;
  opened.model = driver_->identity().model;
  opened.serial = driver_->identity().serial;
  opened.path = driver_->identity().path;
  opened.model_toml = driver_->model_toml();
  opened.opening = sample_.opening;
  opened.has_keeper = keeper_.has_value();
  memory_.opened.store(opened);
}

void Owner::look_for_it(std::int64_t now_ns) {
  if (looked_ns_ != 0 && now_ns - looked_ns_ < kLookAgain_ns) return;
  looked_ns_ = now_ns;
  std::string trouble;
  for (const DriverFamily& family : families_) {
    for (const FoundDevice& found : family.find(options_)) {
      if (!wanted_.matches(found, family.name)) continue;
      if (!found.trouble.empty()) {
        if (trouble.empty()) trouble = fmt::format("{} at {}: {}", found.model, found.path, found.trouble);
        continue;
      }
      tell(Stage::kOpening, fmt::format("opening {} at {}", found.model, found.path));
      auto driver = family.open(found, options_);
      if (driver) {
        opened(*std::move(driver));
        return;
      }
      if (trouble.empty()) trouble = driver.error().message;
    }
  }
  if (trouble.empty()) {
    trouble = wanted_.name == "auto"
                  ? std::string("no haptic device is plugged in")
                  : fmt::format("no {}{}{} is plugged in", wanted_.name,
                                wanted_.serial.empty() ? "" : " with serial number ", wanted_.serial);
  }
  tell(Stage::kAbsent, trouble);
}

void Owner::opened(std::unique_ptr<Driver> driver) {
  driver_ = std::move(driver);
  const std::uint32_t opening = sample_.opening;
  sample_ = Sample{};
  sample_.opening = opening;
  has_asked_for_keeper_ = false;
  taken_off_ = memory_.taken_off.load(std::memory_order_relaxed);
  begin_opening();
}

void Owner::close() {
  // The keeper has nothing to keep before the driver goes, which takes force off itself.
  memory_.owner_beat_ns.store(0, std::memory_order_relaxed);
  driver_.reset();
  keeper_.reset();
}

/// Force needs somebody else who can take it off: before the first command goes out, and as soon as one died.
void Owner::keep_force_off() {
  if (link_fd_ < 0) return;
  const bool has_died = keeper_ && keeper_->has_ended();
  if (has_died) keeper_.reset();
  if (has_asked_for_keeper_ && !has_died) return;
  has_asked_for_keeper_ = true;
  opened_ns_ = realtime::monotonic_now_ns();
  if (const std::optional<ZeroForce> zero = driver_->zero_force()) {
    if (auto keeper = Keeper::start(link_fd_, *zero)) keeper_.emplace(*std::move(keeper));
  }
  begin_opening();
}

Command Owner::command_at(std::int64_t now_ns) const noexcept {
  Command command;
  if (!memory_.command.load(command)) return {};
  const std::int64_t age_ns = now_ns - command.time_ns;
  const bool counts = sample_.stage == Stage::kReady && command.is_force_on && command.opening == sample_.opening &&
                      age_ns <= kStaleCommand_ns && spatial::is_finite(command.F_hand_B);
  if (counts) return command;
  Command none;
  none.opening = sample_.opening;
  none.is_light_on = command.is_light_on && age_ns <= kStaleCommand_ns;
  return none;
}

void Owner::step(std::int64_t now_ns, std::int64_t deadline_ns) {
  if (!driver_) {
    look_for_it(now_ns);
    return;
  }
  // Before the command, so that a keeper which finds the beat old knows that nothing newer went out. There is nothing
  // to keep while no force can be on: setting up may take its time, and its bytes are no place for a keeper's.
  memory_.owner_beat_ns.store(sample_.stage == Stage::kReady ? now_ns : 0, std::memory_order_relaxed);
  const std::uint32_t taken_off = memory_.taken_off.load(std::memory_order_relaxed);
  if (taken_off != taken_off_) {  // this process hung: what the hand felt is over
    taken_off_ = taken_off;
    begin_opening();
  }
  const std::uint32_t opening = sample_.opening;
  const Stage before = sample_.stage;
  const std::int64_t begun_ns = realtime::monotonic_now_ns();
  Stage stage = driver_->step(deadline_ns, command_at(now_ns), sample_);
  memory_.step_ns.store(realtime::monotonic_now_ns() - begun_ns, std::memory_order_relaxed);
  sample_.opening = opening;
  if (stage == Stage::kAbsent) {
    close();
    looked_ns_ = now_ns;  // it takes the kernel a moment to forget it
    tell(Stage::kAbsent, "the device was unplugged: plug it in again");
    return;
  }
  if (stage == Stage::kReady) {
    if (before != Stage::kReady && before != Stage::kOpening && before != Stage::kAbsent) begin_opening();
    keep_force_off();
    if (keeper_ && memory_.keeper_beat_ns.load(std::memory_order_relaxed) < opened_ns_) stage = Stage::kOpening;
  }
  tell(stage, stage == before ? told_ : driver_->advice());
}

void Owner::run(const std::atomic<bool>& stop) {
  realtime::lock_memory();
  realtime::use_fifo(kPriority);
  realtime::Deadlines deadlines(realtime::monotonic_now_ns(), kPeriod_ns);
  while (!stop.load(std::memory_order_relaxed)) {
    const std::int64_t now_ns = realtime::wait_until(deadlines.current_ns(), 0);
    step(now_ns, deadlines.current_ns() + kPeriod_ns);
    deadlines.advance(realtime::monotonic_now_ns());
  }
  close();
  tell(Stage::kAbsent, "the device's owner has ended");
}

}  // namespace farfeel::devices
