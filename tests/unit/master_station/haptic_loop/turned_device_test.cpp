// A device may stand anywhere and any way round on the desk: X_WB says how, and the hand feels the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <numbers>

#include "tests/unit/master_station/haptic_loop/rig.h"

namespace farfeel::master_station {
namespace {

/// Another device, which tells everything in the frame of a base that stands at X_WB; its own base is the world.
class StandsTurned final : public Device {
 public:
  StandsTurned(Device& device, const spatial::Pose& X_WB) : device_(device), X_WB_(X_WB) {}
  [[nodiscard]] const DeviceCapabilities& capabilities() const noexcept override { return device_.capabilities(); }
  [[nodiscard]] DeviceState read(std::int64_t time_ns) noexcept override {
    DeviceState state = device_.read(time_ns);
    state.X_BD = spatial::inverse(X_WB_) * state.X_BD;
    state.V_BD_B = {spatial::rotate_back(X_WB_, state.V_BD_B.angular_rad_s),
                    spatial::rotate_back(X_WB_, state.V_BD_B.linear_m_s)};
    return state;
  }
  void write(const spatial::Wrench& F_hand_B) noexcept override {
    device_.write({spatial::rotate(X_WB_, F_hand_B.torque_Nm), spatial::rotate(X_WB_, F_hand_B.force_N)});
  }

 private:
  Device& device_;
  spatial::Pose X_WB_;
};

/// A loop whose device stands so, pressed and stroked over ridges by the hand's own intent.
struct Standing {
  explicit Standing(const spatial::Pose& X_WB)
      : simulated(Rig::device_settings(kMediumGrip)), device(simulated, X_WB), loop(device, remote, settings(X_WB)) {
    remote.answer_period_ns = 2'000'000;
    remote.world.amplitude_m = 0.00015;
    remote.world.points_T = {
        {0.09, 0.011, -0.003}, {0.09, -0.011, -0.003}, {-0.09, 0.011, -0.003}, {-0.09, -0.011, -0.003}};
  }
  static HapticLoopSettings settings(const spatial::Pose& X_WB) {
    HapticLoopSettings settings = Rig::loop_settings();
    settings.X_WB = X_WB;
    return settings;
  }
  TickRecord tick() {
    loop.tick({time_ns, 0, 0, 0});
    time_ns += kTick_ns;
    TickRecord record;
    EXPECT_TRUE(loop.records().pop(record));
    return record;
  }
  SimulatedDevice simulated;
  StandsTurned device;
  test_support::AnalyticRemote remote;
  HapticLoop loop;
  std::int64_t time_ns = 5'000'000'000;
};

/// By quarter turns: the axes along which the encoders count stay the base's own.
TEST(TurnedDevice, IsFeltAsOneThatStandsStraight) {
  for (const glm::dvec3& turn_rad :
       {glm::dvec3{0.5 * std::numbers::pi, 0, 0}, glm::dvec3{0, -0.5 * std::numbers::pi, 0}}) {
    Standing straight({}), turned({spatial::rotation_from_vector(turn_rad), {0.1, 0.2, -0.05}});
    double off_N = 0, off_Nm = 0, off_m = 0, largest_N = 0, way_m = 0;
    glm::dvec3 p_before(0);
    for (int i = 0; i < 1'500; ++i) {
      const TickRecord a = straight.tick(), b = turned.tick();
      ASSERT_NE(b.state, LoopState::kFault) << message(turned.loop.fault());
      off_N = std::max(off_N, glm::distance(a.F_hand_W.force_N, b.F_hand_W.force_N));
      off_Nm = std::max(off_Nm, glm::distance(a.F_hand_W.torque_Nm, b.F_hand_W.torque_Nm));
      off_m = std::max(off_m, glm::distance(a.X_WT.p, b.X_WT.p));
      largest_N = std::max(largest_N, glm::length(a.F_hand_W.force_N));
      way_m += i > 0 ? glm::distance(a.X_WT.p, p_before) : 0;
      p_before = a.X_WT.p;
    }
    std::printf("off by %.2e N, %.2e Nm, %.2e m; up to %.2f N, %.3f m of way\n", off_N, off_Nm, off_m, largest_N,
                way_m);
    EXPECT_GT(largest_N, 1);
    EXPECT_GT(way_m, 0.01);
    EXPECT_LT(off_N, 1e-6);
    EXPECT_LT(off_Nm, 1e-8);
    EXPECT_LT(off_m, 1e-10);
  }
}

}  // namespace
}  // namespace farfeel::master_station
