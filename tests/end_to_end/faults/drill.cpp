// A recovery's bound is the protocol's, and what this machine adds: on the way of a pose and its answer the hand's
// thread, the road's twice, and two of the slave's must run. The first two note how late they are themselves; the
// latest of the sleepers on all processors stands for the slave's.
#include "tests/end_to_end/faults/drill.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/end_to_end/faults/remote_world.h"

namespace farfeel::end_to_end {
namespace {

using transport::LaneKind;

constexpr double kMostMigration_ms = 5;  // beyond one round trip
constexpr double kMostRestart_ms = 1000;
constexpr double kAgainLast_ms = 500;  // the longest pause between two tries of a handshake
constexpr std::int64_t kLately_ns = 1'000'000'000;
// A tick of the hand: where one comes so late, the next force is of two periods' motion, or an answer is a tick older.
// What steps do where every tick is on time is for simulated time to say (silences_test).
constexpr std::int64_t kMostLate_ns = 1'000'000;
constexpr double kPatience_s = 20;  // far more than anything here takes
constexpr double kRest_s = 0.7;     // between two faults
constexpr double kClockStep_s = 300;
constexpr std::int64_t kNsPerMs = 1'000'000;

double ms(std::int64_t ns) {
  return 1e-6 * static_cast<double>(ns);
}

transport::LinkSpec road(double round_trip_ms) {
  transport::LinkSpec spec;
  spec.round_trip_ns = static_cast<std::int64_t>(round_trip_ms * kNsPerMs);
  return spec;
}

/// What was decoded is what the slave encoded, number for number.
bool is_scene(const codecs::SceneDescription& here, std::uint32_t number) {
  const auto there = codecs::read_scene(codecs::write_scene(scene_number(number)).value());
  return there && here.name == there->name && here.objects.size() == 1 &&
         here.objects[0].visible_O.positions_O == there->objects[0].visible_O.positions_O;
}

}  // namespace

std::string_view name(FaultKind kind) noexcept {
  constexpr std::array<std::string_view, kFaultKinds> kNames{
      "pause",          "restart",           "other scene",   "partition",        "haptic partition",
      "bulk partition", "one-way partition", "haptic rebind", "bulk rebind",      "both rebind",
      "duplicates",     "reorder",           "small MTU",     "round trip steps", "burst loss",
      "clock steps"};
  return kNames[static_cast<std::size_t>(kind)];
}

Drill::Drill(std::string program, std::uint64_t seed) : program_(std::move(program)), random_(seed) {
  scene_ = static_cast<std::uint32_t>(random_() % 1000);
  start_slave();
  relay_ = std::make_unique<FaultRelay>(transport::loopback().with_port(port_), seed);
  round_trip_ms_ = std::array{0.0, 5.0, 20.0, 50.0}[random_() % 4];
  relay_->set_link(road(round_trip_ms_));
  transport::Greeter greeter;
  greeter.own = operator_key();
  greeter.slave = slave_key().public_key;
  greeter.master = transport::random_identity();
  greeter.wall_clock_ns = [this] { return transport::wall_clock_ns() + clock_offset_ns_; };
  greeter.next_counter = [clock = greeter.wall_clock_ns, last = std::uint64_t{0}]() mutable {
    return last = std::max(last + 1, static_cast<std::uint64_t>(clock()));
  };
  auto session = master_station::MasterSession::connect({{relay_->local()}, greeter, kPatience_s, {}});
  if (!session) throw std::runtime_error("no session: " + session.error().message);
  session_ = *std::move(session);
  if (!is_scene(session_->scene(), scene_)) watch_.violated("the scene is not the slave's");
  hand_ = std::make_unique<Hand>(*session_, watch_);
  rest(2.5);
  if (!waits_until(kPatience_s, [&] { return watch_.push_N > 0.3; }))
    watch_.violated("nothing was felt in the beginning");
}

Drill::~Drill() = default;

void Drill::start_slave() {
  slave_ = std::make_unique<OtherProcess>(
      program_, std::vector<std::string>{"slave", "--port", std::to_string(port_), "--run", std::to_string(watch_.run),
                                         "--scene", std::to_string(scene_)});
  const auto port = slave_->hear<std::uint16_t>();
  if (!port) throw std::runtime_error("the slave did not start");
  port_ = *port;
}

void Drill::rest(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

bool Drill::waits_until(double patience_s, const std::function<bool()>& is_so) const {
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience_s);
  while (!is_so()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

void Drill::recover(FaultOutcome& outcome, std::int64_t passable_ns, double most_ms) {
  std::optional<std::int64_t> answered_ns;
  outcome.round_trip_ms = round_trip_ms_;
  outcome.most_ms = most_ms;
  if (!waits_until(kPatience_s, [&] { return (answered_ns = watch_.answered_since(passable_ns)).has_value(); })) {
    outcome.recovery_ms = 1e3 * kPatience_s;
    return watch_.violated(fmt::format("{}: no answer came any more: {}", name(outcome.kind), session_->trouble()));
  }
  outcome.recovery_ms = ms(*answered_ns - passable_ns);
  wait_for_witnesses(*answered_ns);
  const std::int64_t lately_ns = passable_ns - kLately_ns;
  const double hand_ms = ms(watch_.ticks.worst_since_ns(lately_ns)),
               road_ms = ms(relay_->lateness().worst_since_ns(lately_ns));
  const double sleeper_ms = ms(yardstick_.worst_since_ns(lately_ns));
  outcome.allowance_ms = hand_ms + 2 * road_ms + 2 * sleeper_ms;
  if (outcome.is_late())
    watch_.violated(
        fmt::format("{}: back after {:.1f} ms, where {:.1f} ms are right and this machine was late by {:.1f} ms",
                    name(outcome.kind), outcome.recovery_ms, outcome.most_ms, outcome.allowance_ms));
  if (!waits_until(kPatience_s, [&] { return watch_.push_N > 0.3; }))
    watch_.violated(fmt::format("{}: nothing is felt any more, with the hand's image {:.1f} mm off", name(outcome.kind),
                                1e3 * watch_.image_off_m));
  if (!waits_until(kPatience_s, [&] { return session_->state() == master_station::MasterSession::State::kConnected; }))
    watch_.violated(fmt::format("{}: the bulk lane did not come back: {}", name(outcome.kind), session_->trouble()));
}

// Who was late tells of it when it runs again, which may be after what it made late has come.
void Drill::wait_for_witnesses(std::int64_t of_ns) {
  if (!waits_until(kPatience_s,
                   [&] { return watch_.ticks.has_noted_since(of_ns) && yardstick_.has_woken_since(of_ns); }))
    watch_.violated("the hand, or a thread that only sleeps, stands still");
}

void Drill::restart_slave(bool with_other_scene) {
  slave_->kill9();
  rest(uniform(0, 0.5));
  if (with_other_scene) ++scene_;
  ++watch_.run;
  ++restarts_;
  start_slave();
}

void Drill::take_other_scene() {
  using State = master_station::MasterSession::State;
  if (!waits_until(kPatience_s, [&] { return session_->state() == State::kOtherScene; }))
    return watch_.violated("the other scene did not come: " + session_->trouble());
  hand_.reset();
  if (const auto adopted = session_->adopt_scene(); !adopted) watch_.violated(adopted.error().message);
  if (!is_scene(session_->scene(), scene_)) watch_.violated("the other scene is not the slave's");
  hand_ = std::make_unique<Hand>(*session_, watch_);
}

// A road that stands still for tens of milliseconds again and again, because this machine is busy elsewhere, is none of
// the faults that were asked for.
void Drill::judge_steps() {
  for (const Watch::Step& step : watch_.take_steps()) {
    wait_for_witnesses(step.time_ns);
    const std::int64_t before_ns = step.time_ns - kLately_ns / 2;
    const std::int64_t late_ns =
        std::max({watch_.ticks.worst_since_ns(before_ns), relay_->lateness().worst_since_ns(before_ns),
                  yardstick_.worst_since_ns(before_ns)});
    const std::string what = fmt::format("{}; this machine was late by {:.1f} ms at most", step.what, ms(late_ns));
    if (late_ns > kMostLate_ns) {
      ++shaken_steps_;
      fmt::print("    shaken: {}\n", what);
    } else {
      watch_.violated(what);
    }
  }
}

void Drill::step_clock() {
  clock_offset_ns_ =
      static_cast<std::int64_t>(1e9 * (clock_offset_ns_ == 0 ? (random_() % 2 ? 1 : -1) * kClockStep_s : 0.0));
}

FaultOutcome Drill::make(FaultKind kind) {
  FaultOutcome outcome;
  outcome.kind = kind;
  const double migration_ms = round_trip_ms_ + kMostMigration_ms;
  const std::uint64_t tiles = watch_.tiles;
  switch (kind) {
    case FaultKind::kPause:
      slave_->stop();
      rest(uniform(0.1, 2.0));
      {
        const std::int64_t now_ns = transport::monotonic_ns();
        slave_->go_on();
        recover(outcome, now_ns, migration_ms);
      }
      break;
    case FaultKind::kRestart:
      restart_slave(false);
      recover(outcome, transport::monotonic_ns(), kMostRestart_ms);
      break;
    case FaultKind::kOtherScene:
      relay_->set_most_bytes(1200);
      restart_slave(true);
      take_other_scene();
      recover(outcome, transport::monotonic_ns(), kMostRestart_ms);
      relay_->set_most_bytes(65535);
      break;
    case FaultKind::kPartition:
      relay_->cut_all(true);
      rest(uniform(0.06, 2.5));
      recover(outcome, relay_->cut_all(false), migration_ms);
      break;
    case FaultKind::kHapticPartition:
    case FaultKind::kBulkPartition: {
      const LaneKind lane = kind == FaultKind::kHapticPartition ? LaneKind::kHaptic : LaneKind::kBulk;
      relay_->cut(lane, FaultRelay::kUp, true);
      relay_->cut(lane, FaultRelay::kDown, true);
      rest(uniform(0.06, 2.5));
      relay_->cut(lane, FaultRelay::kUp, false);
      recover(outcome, relay_->cut(lane, FaultRelay::kDown, false), migration_ms);
      break;
    }
    case FaultKind::kOneWayPartition:
      for (const LaneKind lane : {LaneKind::kHaptic, LaneKind::kBulk}) relay_->cut(lane, FaultRelay::kDown, true);
      rest(uniform(0.06, 1.5));
      relay_->cut(LaneKind::kBulk, FaultRelay::kDown, false);
      recover(outcome, relay_->cut(LaneKind::kHaptic, FaultRelay::kDown, false), migration_ms);
      break;
    case FaultKind::kHapticRebind:
      recover(outcome, relay_->rebind(LaneKind::kHaptic), migration_ms);
      break;
    case FaultKind::kBulkRebind:
      recover(outcome, relay_->rebind(LaneKind::kBulk), migration_ms);
      break;
    case FaultKind::kBothRebind:
      relay_->rebind(LaneKind::kBulk);
      recover(outcome, relay_->rebind(LaneKind::kHaptic), migration_ms);
      break;
    case FaultKind::kDuplicates:
    case FaultKind::kReorder:
    case FaultKind::kBurstLoss: {
      transport::LinkSpec spec = road(round_trip_ms_);
      if (kind == FaultKind::kDuplicates) spec.duplicate = 0.33;
      if (kind == FaultKind::kReorder) spec.reorder = 0.2, spec.jitter_ns = 3 * kNsPerMs;
      if (kind == FaultKind::kBurstLoss) spec.loss = 0.2, spec.burst = 20;
      relay_->set_link(spec);
      rest(uniform(0.5, 1.5));
      recover(outcome, relay_->set_link(road(round_trip_ms_)), 0);
      break;
    }
    case FaultKind::kSmallMtu:
      relay_->set_most_bytes(1200);
      rest(uniform(0.5, 1.5));
      recover(outcome, relay_->set_most_bytes(65535), 0);
      break;
    case FaultKind::kRoundTripSteps: {
      for (const double step_ms : {20.0, 200.0, 20.0}) {
        relay_->set_link(road(step_ms));
        rest(1.2);
      }
      recover(outcome, relay_->set_link(road(round_trip_ms_)), 0);
      break;
    }
    case FaultKind::kClockSteps: {
      step_clock();
      const double expected_s = -1e-9 * static_cast<double>(clock_offset_ns_);
      const auto knows = [&] { return std::abs(session_->clock_difference_s() - expected_s) < 5; };
      // A silence asks for new keys; what is heard again sooner than they are made makes them needless.
      for (int silences = 0; !knows() && silences < 20; ++silences) {
        relay_->cut_all(true);
        rest(0.15);
        recover(outcome, relay_->cut_all(false), migration_ms);
        (void)waits_until(0.3, knows);
      }
      if (!knows()) watch_.violated("no new keys were made after the clock had stepped");
      break;
    }
  }
  if (!waits_until(kPatience_s, [&] { return watch_.tiles > tiles; }))
    watch_.violated(fmt::format("{}: tiles come no more", name(kind)));
  judge_steps();
  return outcome;
}

std::vector<FaultOutcome> Drill::run(const std::function<void(const FaultOutcome&)>& tell) {
  std::array<FaultKind, kFaultKinds> order;
  for (std::size_t i = 0; i < kFaultKinds; ++i) order[i] = static_cast<FaultKind>(i);
  for (std::size_t i = kFaultKinds - 1; i > 0; --i) std::swap(order[i], order[random_() % (i + 1)]);
  std::vector<FaultOutcome> outcomes;
  for (const FaultKind kind : order) {
    outcomes.push_back(make(kind));
    tell(outcomes.back());
    rest(kRest_s);
  }
  if (const auto sessions = session_->report().sessions; sessions != 1 + restarts_)
    watch_.violated(fmt::format("{} sessions with a slave that was started {} times", sessions, 1 + restarts_));
  return outcomes;
}

FaultOutcome Drill::let_keys_die() {
  FaultOutcome outcome;
  outcome.kind = FaultKind::kPartition;
  relay_->cut_all(true);
  rest(1e-9 * static_cast<double>(transport::kKeyLife_ns) + 1);
  recover(outcome, relay_->cut_all(false), 2 * round_trip_ms_ + kAgainLast_ms);
  return outcome;
}

}  // namespace farfeel::end_to_end
