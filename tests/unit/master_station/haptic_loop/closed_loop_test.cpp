// Device, hand, loop and a remote with delay, closed: calm under every grip and round trip.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "tests/unit/master_station/haptic_loop/rig.h"

namespace farfeel::master_station {
namespace {

/// Rms of what a first-order high pass at 20 Hz leaves of the normal force over the last 0.25 s, against its mean.
double ripple(const std::vector<double>& force_N) {
  const double pole = std::exp(-2 * std::numbers::pi * 20 * 1e-3);
  double high = 0, previous = force_N.front(), sum = 0, squares = 0;
  const std::size_t from = force_N.size() - 250;
  for (std::size_t i = 0; i < force_N.size(); ++i) {
    high = pole * (high + force_N[i] - previous);
    previous = force_N[i];
    if (i >= from) sum += force_N[i], squares += high * high;
  }
  return std::sqrt(squares / 250) / std::abs(sum / 250);
}

class ClosedLoopTest : public ::testing::TestWithParam<std::tuple<Grip, double>> {};

TEST_P(ClosedLoopTest, PressesStrokesAndStaysCalm) {
  const auto [grip, round_trip_s] = GetParam();
  Rig rig(grip, round_trip_s);
  rig.remote.world.amplitude_m = 0.00015;
  std::size_t touching = 0, contacts = 0;
  constexpr int kTicks = 5'000;
  for (int i = 0; i < kTicks; ++i) {
    const TickRecord record = rig.tick();
    ASSERT_TRUE(spatial::is_finite(record.F_hand_W));
    ASSERT_NE(record.state, LoopState::kFault) << message(rig.loop.fault());
    touching += record.contacts > 0;
    contacts += record.contacts;
  }
  const double share = static_cast<double>(touching) / kTicks;
  EXPECT_GE(share, 0.7);
  EXPECT_GE(static_cast<double>(contacts), 3.0 * static_cast<double>(touching));
  // The hand never got back more than it had put in: the design's bound for one held tick is far below a microjoule
  // here.
  EXPECT_GE(rig.device.hand_port().least_J(), -1e-6);

  // Hold still: the ripple above 20 Hz dies within a second.
  rig.hold(3);
  std::vector<double> force_N;
  for (int i = 0; i < 1250; ++i) force_N.push_back(rig.tick().F_hand_W.force_N.z);
  EXPECT_LE(ripple(force_N), 0.05);  // after a second, the design's word for stable
}

// The midpoint rule damps nothing by itself: what keeps the loop calm then is its own dampers.
TEST(IntegratorTest, TheMidpointRuleIsAsCalmAndAsPassiveInTheLoop) {
  for (const double round_trip_s : {0.0, 0.1}) {
    Rig rig(kMediumGrip, round_trip_s, 500, local_model::Rung::kLinear, {}, tool::Integrator::kMidpoint);
    rig.remote.world.amplitude_m = 0.00015;
    for (int i = 0; i < 4'000; ++i) {
      const TickRecord record = rig.tick();
      ASSERT_NE(record.state, LoopState::kFault) << message(rig.loop.fault());
    }
    EXPECT_GE(rig.device.hand_port().least_J(), -1e-6);
    rig.hold(3);
    std::vector<double> force_N;
    for (int i = 0; i < 1250; ++i) force_N.push_back(rig.tick().F_hand_W.force_N.z);
    EXPECT_LE(ripple(force_N), 0.05) << round_trip_s;
  }
}

INSTANTIATE_TEST_SUITE_P(GripsAndDelays, ClosedLoopTest,
                         ::testing::Combine(::testing::Values(kSoftGrip, kMediumGrip, kHardGrip),
                                            ::testing::Values(0.0, 0.02, 0.1)),
                         [](const auto& named) {
                           return std::string(std::get<0>(named.param).name) + "_" +
                                  std::to_string(static_cast<int>(1e3 * std::get<1>(named.param))) + "ms";
                         });

}  // namespace
}  // namespace farfeel::master_station
