#include "tests/end_to_end/faults/hand.h"

#include <fmt/format.h>

#include <cmath>

#include "tests/end_to_end/faults/remote_world.h"

namespace farfeel::end_to_end {
namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr std::int64_t kSettles = 2000;  // ticks until a hand that came down from nowhere is still
constexpr master_station::Grip kGrip = master_station::kMediumGrip;
constexpr double kPress_N = 2, kPressSwing_N = 1, kPressHz = 0.5;
constexpr double kFollows_m_per_s = 0.02;
constexpr double kMostOff_m = 4e-6;  // of a plane's height, as poses and depths are told

spatial::Pose handle_in_tool() {
  return {glm::inverse(where_pressed().R), {0, 0, 0}};
}

master_station::SimulatedDeviceSettings device_settings() {
  master_station::SimulatedDeviceSettings settings;
  settings.grip = kGrip;
  settings.explorer.X_TG = handle_in_tool();
  settings.explorer.hints = {.p_TWork_T = {0, 0, 0},
                             .nhat_work_T = {0, 0, 1},
                             .region_low_W = {-0.004, -0.003, 0},
                             .region_high_W = {0.004, 0.003, 0.004},
                             .approach_W = {0, 0, -1},
                             .press_force_N = kPress_N,
                             .stroke_speed_m_per_s = 0.05};
  return settings;
}

/// Whether `run` may tell what is marked so: it is the newest that was started, or the one before.
std::optional<std::uint32_t> run_of_mark(std::uint32_t mark, std::uint32_t newest) {
  for (const std::uint32_t run : {newest, newest - 1}) {
    if (run <= newest && mark == run % kRunsTold) return run;
  }
  return std::nullopt;
}

}  // namespace

spatial::Pose where_pressed() {
  return {glm::dquat{0, 1, 0, 0}, {0, 0.1e-3, level_m(0) - 1e-3}};
}

/// A hand that presses harder and less hard, with its image, which it sees. Where this machine stood still and the
/// handle went far from the tool meanwhile, the loop takes hold of the tool anew: the image is elsewhere then, and the
/// hand follows.
class Hand::Pressing final : public master_station::Device {
 public:
  Pressing() : device_(device_settings()) {}
  const master_station::DeviceCapabilities& capabilities() const noexcept override { return device_.capabilities(); }
  master_station::DeviceState read(std::int64_t time_ns) noexcept override {
    if (began_ns_ == 0) began_ns_ = time_ns;
    const double phase = 2 * std::numbers::pi * kPressHz * 1e-9 * static_cast<double>(time_ns - began_ns_);
    const double press_N = kPress_N + kPressSwing_N * std::sin(phase);
    const double most_m = kFollows_m_per_s * 1e-9 * static_cast<double>(std::min(time_ns - read_ns_, kPeriod_ns));
    const glm::dvec3 left_m = off_m_ - followed_m_;
    const double left = glm::length(left_m);
    followed_m_ = left > most_m ? followed_m_ + most_m / left * left_m : off_m_;
    const glm::dvec3 pressed_m{0, 0.1e-3, level_m(0) - press_N / kGrip.stiffness_N_per_m};
    device_.hold_at({{1, 0, 0, 0}, pressed_m - followed_m_});
    read_ns_ = time_ns;
    const master_station::DeviceState state = device_.read(time_ns);
    handle_m_ = state.X_BD.p;
    return state;
  }
  /// Where its image is; returns how far from where it would be, had the machine never stood still.
  double see(const glm::dvec3& image_m) {
    off_m_ = image_m - handle_m_;
    return glm::length(off_m_);
  }
  void write(const spatial::Wrench& F_hand_B) noexcept override { device_.write(F_hand_B); }
  double hand_energy_J() const noexcept override { return device_.hand_energy_J(); }

 private:
  master_station::SimulatedDevice device_;
  std::int64_t began_ns_ = 0, read_ns_ = 0;
  glm::dvec3 handle_m_{0}, off_m_{0}, followed_m_{0};
};

/// The haptic lane, and a look at all that it gives.
class Hand::WatchedRemote final : public master_station::Remote {
 public:
  WatchedRemote(master_station::Remote& lane, Watch& watch) : lane_(lane), watch_(watch), sent_ns_(kPoses) {}
  void send(const master_station::ToolState& state) noexcept override {
    sent_ns_[state.sequence % kPoses] = transport::monotonic_ns();
    lane_.send(state);
  }
  bool poll(contact::ContactSet& newest) noexcept override {
    if (!lane_.poll(newest)) return false;
    const std::int64_t now_ns = transport::monotonic_ns();
    if (has_answer_ && static_cast<std::int32_t>(newest.pose_sequence - sequence_) <= 0)
      watch_.violated(fmt::format("an answer to pose {} came after one to {}", newest.pose_sequence, sequence_));
    has_answer_ = true;
    sequence_ = newest.pose_sequence;
    newest_sent_ns_ = sent_ns_[sequence_ % kPoses];
    check(newest);
    watch_.note_answer(newest_sent_ns_, now_ns);
    return true;
  }
  /// Of the pose that the newest answer is about; 0 before any.
  [[nodiscard]] std::int64_t newest_sent_ns() const { return newest_sent_ns_; }

 private:
  static constexpr std::size_t kPoses = 16'384;

  void check(const contact::ContactSet& set) {
    if (set.count != plane(run_).contacts(set.X_WT).count)
      watch_.violated(fmt::format("{} contacts {} m above a plane", set.count, set.X_WT.p.z - level_m(run_)));
    for (std::uint32_t i = 0; i < set.count; ++i) {
      const double level = set.contacts[i].depth_m + set.contacts[i].p_WC_W.z;
      const auto mark = std::llround((level - level_m(0)) / (level_m(1) - level_m(0)));
      const std::uint32_t newest = watch_.run;
      const auto run = mark >= 0 && mark < kRunsTold ? run_of_mark(static_cast<std::uint32_t>(mark), newest)
                                                     : std::optional<std::uint32_t>{};
      if (!run || std::abs(level - level_m(*run)) > kMostOff_m)
        return watch_.violated(fmt::format("a plane at {} m, which run {} does not feel", level, newest));
      if (*run < run_) return watch_.violated(fmt::format("contacts of run {} after some of run {}", *run, run_));
      run_ = *run;
    }
  }

  master_station::Remote& lane_;
  Watch& watch_;
  std::vector<std::int64_t> sent_ns_;
  bool has_answer_ = false;
  std::uint32_t sequence_ = 0, run_ = 0;
  std::int64_t newest_sent_ns_ = 0;
};

Hand::Hand(master_station::MasterSession& session, Watch& watch)
    : session_(session),
      watch_(watch),
      device_(std::make_unique<Pressing>()),
      remote_(std::make_unique<WatchedRemote>(session.remote(), watch)) {
  session_.want_tiles();
  if (session_.tiles() != nullptr) told_.resize(session_.tiles()->scene().bodies.at(1).surface.tiles.size());
  master_station::HapticLoopSettings settings;
  settings.timing.period_ns = kPeriod_ns;
  settings.body = {0.05, Eigen::Vector3d(1e-5, 1e-5, 1e-5).asDiagonal()};
  settings.X_TG = handle_in_tool();
  spring_N_per_m_ =
      master_station::coupling_for(device_->capabilities(), {}, settings.body, kPeriod_ns).stiffness_N_per_m;
  loop_ = std::make_unique<master_station::HapticLoop>(*device_, *remote_, settings);
  thread_ = std::thread([this, timing = settings.timing] {
    realtime::PeriodicStatistics statistics;
    realtime::run_periodically(timing, is_over_, statistics, [this](const realtime::TickTiming& t) { tick(t); });
  });
}

Hand::~Hand() {
  is_over_ = true;
  thread_.join();
}

/// A hand that sinks at 60 mm/s, since nothing held it any more, meets a surface that is back: against a spring of 2
/// N/mm the force grows by 0.12 N a tick by the hand's own motion, and no session could tell it otherwise. The rest is
/// a step.
double Hand::step_N(const master_station::TickRecord& record) const {
  const glm::dvec3 change_N = record.F_hand_W.force_N - last_force_N_;
  const glm::dvec3 by_hand_N = -spring_N_per_m_ * (record.X_WI.p - last_handle_m_);
  return std::min(glm::length(change_N), glm::length(change_N - by_hand_N));
}

void Hand::tick(const realtime::TickTiming& timing) {
  loop_->tick(timing);
  master_station::TickRecord record;
  if (!loop_->records().pop(record)) return watch_.violated("a tick left no record");
  const std::int64_t began_ns = timing.deadline_ns + timing.wake_ns, now_ns = transport::monotonic_ns();
  watch_.ticks.note(now_ns, now_ns - timing.deadline_ns);
  if (ticks_++ > kSettles) {
    // The loop's own time: a tick that woke late is a longer one, for the hand went on meanwhile.
    const double ticks_due = std::max(1.0, static_cast<double>(began_ns - began_ns_) / kPeriod_ns);
    const double step = step_N(record) / ticks_due;
    watch_.largest_step_N = std::max(watch_.largest_step_N.load(), step);
    if (step > kMostStep_N)
      watch_.note_step(
          now_ns,
          fmt::format("the force stepped by {:.3f} N a tick, over {:.2f} ticks, in state {} after {}, the newest "
                      "answer {:.1f} ms old, "
                      "from {:.3f} to {:.3f} N; contacts push {:.3f} N after {:.3f}",
                      step, ticks_due, master_station::name(record.state), master_station::name(last_state_),
                      1e-6 * static_cast<double>(began_ns - remote_->newest_sent_ns()), last_force_N_.z,
                      record.F_hand_W.force_N.z, glm::length(record.F_contact_To_W.force_N), watch_.push_N.load()));
    const double age_s = 1e-9 * static_cast<double>(began_ns - remote_->newest_sent_ns());
    if (age_s > kOldest_s && glm::length(record.F_contact_To_W.force_N) > 0.05)
      watch_.violated(
          fmt::format("contacts {} s old push with {} N", age_s, glm::length(record.F_contact_To_W.force_N)));
    if (loop_->fault() != master_station::Fault::kNone)
      watch_.violated(fmt::format("the loop stopped: {}", master_station::message(loop_->fault())));
  }
  began_ns_ = began_ns;
  last_handle_m_ = record.X_WI.p;
  last_force_N_ = record.F_hand_W.force_N;
  last_state_ = record.state;
  watch_.image_off_m = device_->see(record.X_WI.p);
  watch_.push_N = glm::length(record.F_contact_To_W.force_N);
  look_at_tiles();
}

void Hand::look_at_tiles() {
  constexpr std::uint32_t kAtOnce = 8;
  local_model::TileCache* const cache = session_.tiles();
  if (cache == nullptr || cache->take_arrived(kAtOnce) == 0) return;
  const auto& tiles = cache->scene().bodies.at(1).surface.tiles;
  for (std::uint32_t i = 0; i < tiles.size(); ++i) {
    const geometry::HeightTile& tile = tiles[i];
    if (tile.version == 0 || !cache->has({1, i})) continue;
    const std::uint32_t mark = (tile.coefficients[0] - 30'000u) / 100u;
    if (tile.version == told_[i].version && mark == told_[i].run_told) continue;
    watch_.tiles.fetch_add(1, std::memory_order_relaxed);
    const std::uint32_t newest = watch_.run;
    const auto run = run_of_mark(mark, newest);
    if (!run || tile.coefficients != told_tile(*run, tile.version).coefficients)
      return watch_.violated(fmt::format("tile {} of version {} is none that run {} told", i, tile.version, newest));
    const auto run_before = run_of_mark(told_[i].run_told, newest);
    if (told_[i].version > 0 && run_before &&
        (*run < *run_before || (*run == *run_before && tile.version < told_[i].version)))
      watch_.violated(fmt::format("tile {} went from version {} of run {} back to {} of {}", i, told_[i].version,
                                  *run_before, tile.version, *run));
    told_[i] = {mark, tile.version};
  }
}

}  // namespace farfeel::end_to_end
