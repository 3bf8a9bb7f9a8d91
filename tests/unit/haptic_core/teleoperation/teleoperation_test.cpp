#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <random>

#include "haptic_core/teleoperation/handle_end.h"
#include "haptic_core/teleoperation/remote_end.h"

namespace farfeel::teleoperation {
namespace {

using spatial::Vector6;

constexpr double kTick_s = 1e-3;

tool::MassProperties body() {
  return {0.02, Eigen::Vector3d(4e-6, 4e-6, 4e-6).asDiagonal()};
}

/// A floor at z = 0, elastic, as an implicit step needs it.
tool::LinearResponse floor(const spatial::Pose& X_WT, double stiffness_N_per_m) {
  tool::LinearResponse response;
  if (X_WT.p.z >= 0) return response;
  response.F_To_W[5] = -stiffness_N_per_m * X_WT.p.z;
  response.by_pose(5, 5) = -stiffness_N_per_m;
  return response;
}

/// Both ends and a bad line between them: delayed, lost, and answered only now and then, so that what came last is felt
/// for longer than it was made for.
struct Line {
  Line(Controller controller, int delay_ticks, double loss, int answer_every)
      : delay(delay_ticks), every(answer_every), lost(loss), handle(controller), remote(controller, body(), {}) {}
  /// One tick of a handle that moves with V; the wrench on it.
  Vector6 tick(const Vector6& V) {
    std::uniform_real_distribution<> share;
    const auto pass = [&](std::deque<std::pair<int, LineValue>>& way, const LineValue& value) {
      if (share(random) >= lost) way.push_back({ticks + delay, value});
    };
    const auto take = [&](std::deque<std::pair<int, LineValue>>& way, LineValue& newest) {
      for (; !way.empty() && way.front().first <= ticks; way.pop_front()) newest = way.front().second;
    };
    take(back, here);
    const HandleEnd::Step step = handle.tick(V, here, kTick_s);
    pass(there, step.out);
    take(there, far);
    if (ticks % every == 0) pass(back, remote.answer(far, floor(remote.tool().X_WT, 1000), every * kTick_s));
    ++ticks;
    put_in_J -= step.F_hand.dot(V) * kTick_s;
    least_J = std::min(least_J, put_in_J);
    return step.F_hand;
  }
  int delay, every, ticks = 0;
  double lost, put_in_J = 0, least_J = 0;
  HandleEnd handle;
  RemoteEnd remote;
  LineValue here, far;
  std::deque<std::pair<int, LineValue>> there, back;
  std::mt19937 random{1};
};

Vector6 up_and_down(int tick) {
  Vector6 V = Vector6::Zero();
  V[5] = 0.05 * std::sin(0.01 * tick) * (1 + 0.5 * std::sin(0.37 * tick));
  V[0] = 0.3 * std::cos(0.023 * tick);
  return V;
}

TEST(Controllers, HaveTheirNamesAndNoOthers) {
  for (const Controller c : {Controller::kOurs, Controller::kDirect, Controller::kWaves, Controller::kPassivity})
    EXPECT_EQ(find_controller(name(c)), c);
  EXPECT_FALSE(find_controller("theirs"));
}

// The hand never gets back more than it put in, whatever the line does with the messages.
TEST(Waves, StayPassiveWhereMessagesAreLateLostAndFeltForLongerThanTheyWereMadeFor) {
  for (const int delay : {0, 20, 100})
    for (const double loss : {0.0, 0.3})
      for (const int every : {1, 2, 7}) {
        Line line(Controller::kWaves, delay, loss, every);
        for (int i = 0; i < 8000; ++i) ASSERT_TRUE(line.tick(up_and_down(i)).allFinite());
        EXPECT_GE(line.least_J, -1e-6) << delay << " ticks, loss " << loss << ", every " << every;
      }
}

TEST(Waves, PressTheRemoteToolOntoTheFloorAndTheHandFeelsIt) {
  Line line(Controller::kWaves, 10, 0, 1);
  Vector6 V = Vector6::Zero(), F = V;
  V[5] = -0.02;
  for (int i = 0; i < 400; ++i) F = line.tick(V);
  EXPECT_LT(line.remote.tool().X_WT.p.z, -1e-4);
  EXPECT_GT(F[5], 0.1);
}

// Its damping is bounded, and so is what it can take back: direct force across the same line is far worse.
TEST(Passivity, TakesBackMostOfWhatTheDelayGives) {
  for (const int delay : {5, 20, 50}) {
    Line controlled(Controller::kPassivity, delay, 0.1, 1);
    for (int i = 0; i < 8000; ++i) ASSERT_TRUE(controlled.tick(up_and_down(i)).allFinite());
    EXPECT_GE(controlled.least_J, -0.02) << delay;
  }
}

}  // namespace
}  // namespace farfeel::teleoperation
