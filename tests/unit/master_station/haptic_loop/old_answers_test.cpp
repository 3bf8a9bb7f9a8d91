// A hand that presses while the link's round trip steps and its queue fills: what is old is held and fades, what is
// merely far is felt, and the force on the hand never jumps.
#include <algorithm>
#include <cmath>

#include "tests/unit/master_station/haptic_loop/rig.h"

namespace farfeel::master_station {
namespace {

constexpr double kJump_N = 0.2;

class OldAnswersTest : public ::testing::Test {
 protected:
  void start(double round_trip_s) {
    set_round_trip(round_trip_s);
    rig.hold(3);
    for (int i = 0; i < 3000; ++i) last = rig.tick();
    ASSERT_EQ(last.state, LoopState::kTouching);
    pressed_N = last.F_hand_W.force_N.z;
    ASSERT_GT(pressed_N, 1);
  }
  void set_round_trip(double seconds) { rig.remote.set_link({.round_trip_ns = std::llround(1e9 * seconds)}); }
  struct Seen {
    int held = 0, fading = 0, last_unsure = 0;  ///< ticks
    double least_N = 1e9;
  };
  Seen run(int ticks) {
    Seen seen;
    for (int i = 1; i <= ticks; ++i) {
      const TickRecord record = rig.tick();
      EXPECT_LE(glm::length(record.F_hand_W.force_N - last.F_hand_W.force_N), kJump_N) << "tick " << i;
      last = record;
      seen.held += record.state == LoopState::kHeld;
      seen.fading += record.state == LoopState::kFading;
      if (record.state == LoopState::kHeld || record.state == LoopState::kFading) seen.last_unsure = i;
      seen.least_N = std::min(seen.least_N, record.F_hand_W.force_N.z);
    }
    return seen;
  }
  Rig rig{kMediumGrip, 0, 1000};
  TickRecord last;
  double pressed_N = 0;
};

TEST_F(OldAnswersTest, ASteadyRoundTripIsNeverHeld) {
  start(0.3);
  const Seen seen = run(5000);
  EXPECT_EQ(seen.held + seen.fading, 0);
}

TEST_F(OldAnswersTest, AStepTo200MsIsHeldForTheWindowAndItsForceStays) {
  start(0.02);
  set_round_trip(0.2);
  const Seen seen = run(5000);
  EXPECT_GT(seen.held, 1800);
  EXPECT_EQ(seen.fading, 0);
  EXPECT_LT(seen.last_unsure, 2400);
  EXPECT_GT(seen.least_N, 0.8 * pressed_N);
  EXPECT_EQ(last.state, LoopState::kTouching);
  set_round_trip(0.02);
  EXPECT_EQ(run(3000).held, 0) << "and back";
}

TEST_F(OldAnswersTest, AStepTo600MsFadesAndIsFeltAgainAfterTheWindow) {
  start(0.02);
  set_round_trip(0.6);
  const Seen seen = run(5000);
  EXPECT_GT(seen.fading, 1800);
  EXPECT_LT(seen.last_unsure, 2900);
  EXPECT_LT(seen.least_N, 0.05 * pressed_N);
  EXPECT_NEAR(last.F_hand_W.force_N.z, pressed_N, 0.1 * pressed_N);
}

TEST_F(OldAnswersTest, AFullQueueFadesForAsLongAsItStands) {
  start(0.02);
  // Half of what the answers need: the queue grows by a second each second, to 3 s.
  rig.remote.set_link({.round_trip_ns = 20'000'000, .rate_bit_per_s = 0.8e6, .queue_ns = 3'000'000'000});
  run(1000);
  EXPECT_EQ(last.state, LoopState::kFading);
  const Seen filled = run(9000);
  EXPECT_EQ(filled.fading, 9000) << "answers of 3 s ago, hundreds a second";
  EXPECT_EQ(glm::length(last.F_contact_To_W.force_N), 0);
  set_round_trip(0.02);
  run(2000);
  EXPECT_EQ(last.state, LoopState::kTouching);
  EXPECT_NEAR(last.F_hand_W.force_N.z, pressed_N, 0.1 * pressed_N);
}

TEST_F(OldAnswersTest, AnAnswerToAPoseOfTheFutureOrOfBeforeTheSessionIsNone) {
  start(0);
  for (const std::int64_t off_ns : {std::int64_t{1} << 61, -(std::int64_t{1} << 61)}) {
    const std::uint64_t before = rig.loop.sets_out_of_order();
    rig.remote.on_answer = [=](contact::ContactSet& set) { set.pose_time_ns += off_ns; };
    run(300);
    EXPECT_GT(rig.loop.sets_out_of_order(), before + 290);
    EXPECT_EQ(last.state, LoopState::kFading);
    rig.remote.on_answer = nullptr;
    run(1000);
    EXPECT_EQ(last.state, LoopState::kTouching);
  }
}

}  // namespace
}  // namespace farfeel::master_station
