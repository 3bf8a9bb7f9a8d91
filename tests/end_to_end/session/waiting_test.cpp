// The round trip that is told to the operator holds what a pose waited at the slave: in its socket, and for a thread
// that was busy. What is taken out is the time that the slave computed, and nothing else.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <limits>

#include "codecs/wire/pose_message.h"
#include "tests/end_to_end/session/both_ends.h"

namespace farfeel::end_to_end {
namespace {

constexpr std::size_t kMostPoses = 4096;

/// A floor that takes its time, and notes when it began with each pose and when it was done.
class SlowFloor final : public slave_sim::ContactSource {
 public:
  struct Work {
    std::atomic<std::int64_t> began_ns{0}, ended_ns{0};
  };
  explicit SlowFloor(std::chrono::microseconds takes) : takes_(takes) {}
  const contact_service::Answer& answer(const contact_service::ToolPose& pose) noexcept override {
    Work& work = works[index_of(pose.time_ns)];
    work.began_ns = transport::monotonic_ns();
    std::this_thread::sleep_for(takes_);
    work.ended_ns = transport::monotonic_ns();
    return floor_.answer(pose);
  }
  void restart() noexcept override {}
  /// Poses are told apart by their times: one microsecond a pose.
  static std::size_t index_of(std::int64_t time_ns) { return static_cast<std::size_t>(time_ns / 1000) % kMostPoses; }
  std::array<Work, kMostPoses> works;

 private:
  std::chrono::microseconds takes_;
  Floor floor_;
};

// Poses come faster than they are answered, so that the newest always waits for the thread. What is told is at most all
// that passed, less the work, in each answer. It is at least what was waited before the work began, but where this
// machine halts a thread between its look at the clock and what it does next: in most answers, and in the sum.
TEST(Waiting, AtTheSlaveIsPartOfTheRoundTripAndItsWorkIsNot) {
  SlowFloor floor(std::chrono::milliseconds(5));
  const auto remote = slave(floor, transport::loopback());
  const auto session = master(remote->local());
  std::array<std::int64_t, kMostPoses> sent_ns{};
  contact::ContactSet newest;
  double told_ms = 0, waited_ms = 0;
  int answers = 0, has_waiting = 0;
  constexpr double kResolution_ms = 4e-3;  // the wire counts three times in microseconds
  for (std::uint32_t i = 1; i < kMostPoses && answers < 100; ++i) {
    master_station::ToolState state;
    state.sequence = i;
    state.time_ns = 1000 * static_cast<std::int64_t>(i);
    sent_ns[i] = transport::monotonic_ns();
    session->remote().send(state);
    std::this_thread::sleep_for(std::chrono::microseconds(1700));  // shares no beat with the work
    if (!session->remote().poll(newest)) continue;
    const std::size_t pose = SlowFloor::index_of(newest.pose_time_ns);
    const auto& work = floor.works[pose];
    const double trip_ms = session->remote().newest_round_trip_ms();
    const double before_ms = 1e-6 * static_cast<double>(work.began_ns - sent_ns[pose]);
    const double all_ms = 1e-6 * static_cast<double>(transport::monotonic_ns() - sent_ns[pose]);
    // What was held for longer than the wire can tell brings no round trip: the newest one is an older answer's.
    if (all_ms > 1e-3 * codecs::kLongHold) continue;
    has_waiting += trip_ms >= before_ms - kResolution_ms;
    EXPECT_LE(trip_ms, all_ms - 1e-6 * static_cast<double>(work.ended_ns - work.began_ns) + kResolution_ms);
    told_ms += trip_ms, waited_ms += before_ms;
    ++answers;
  }
  ASSERT_EQ(answers, 100);
  EXPECT_GT(waited_ms, 20) << "poses were to wait, a third of the time between two of them at least";
  EXPECT_GE(has_waiting, 80);
  EXPECT_GE(told_ms, 0.8 * waited_ms);
}

}  // namespace
}  // namespace farfeel::end_to_end
