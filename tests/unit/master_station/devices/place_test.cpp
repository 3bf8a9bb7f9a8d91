// A part may stand anywhere in its file: the device stands before it, and the hand feels the same.
#include "master_station/devices/place.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/guarded_rig.h"

namespace farfeel::devices {
namespace {

using master_station::HapticLoop;
using master_station::SimulatedDevice;
using master_station::TickRecord;

/// The rig's hand and surface, moved together, and the device placed before them.
struct Moved {
  Moved(const glm::dvec3& by_m, double scale, const DeviceModel& model = *find_model("simulated")) {
    auto settings = GuardedRig::device_settings(model, master_station::kMediumGrip);
    settings.explorer.hints.region_low_W += by_m, settings.explorer.hints.region_high_W += by_m;
    settings.workspace_scale = scale;
    const spatial::Pose X_WB = master_station::X_WB_before(
        settings.explorer.hints, 0.5 * (model.workspace_min_B_m + model.workspace_max_B_m), scale);
    settings.p_WB = X_WB.p;
    device.emplace(settings);
    guard.emplace(*device, GuardSettings{.model = model});
    auto loop_settings = GuardedRig::loop_settings();
    loop_settings.X_WB = X_WB;
    loop_settings.scales.workspace = scale;
    remote.answer_period_ns = 2'000'000;
    remote.world.material.stiffness_N_per_m = 250;
    remote.world.points_T = {
        {0.09, 0.011, -0.003}, {0.09, -0.011, -0.003}, {-0.09, 0.011, -0.003}, {-0.09, -0.011, -0.003}};
    remote.world.level_m = by_m.z;
    loop.emplace(*guard, remote, loop_settings);
  }
  TickRecord tick() {
    loop->tick({time_ns, 0, 0, 0});
    time_ns += GuardedRig::kTick_ns;
    TickRecord record;
    EXPECT_TRUE(loop->records().pop(record));
    return record;
  }
  std::optional<SimulatedDevice> device;
  std::optional<GuardedDevice> guard;
  test_support::AnalyticRemote remote;
  std::optional<HapticLoop> loop;
  std::int64_t time_ns = 5'000'000'000;
};

TEST(DevicePlace, APartFarFromItsOriginFeelsAsOneAtIt) {
  DeviceModel model = *find_model("simulated");
  model.position_step_m = model.rotation_step_rad = 0;  // a count falls this way or that by the last bit
  for (const double scale : {1.0, 4.0}) {
    for (const glm::dvec3& by_m : {glm::dvec3(1, 0, 0), glm::dvec3(3, -7, 2), glm::dvec3(500, 45, -12)}) {
      Moved at_origin({}, scale, model), far(by_m, scale, model);
      double off_N = 0, off_m = 0, pressed_N = 0, in_air_N = 0;
      for (int i = 0; i < 2'500; ++i) {
        const TickRecord a = at_origin.tick(), b = far.tick();
        off_N = std::max(off_N, glm::distance(a.F_hand_W.force_N, b.F_hand_W.force_N));
        off_m = std::max(off_m, glm::distance(a.X_WT.p + by_m, b.X_WT.p));
        pressed_N = std::max(pressed_N, glm::length(b.F_hand_W.force_N));
        if (i < 100) in_air_N = std::max(in_air_N, glm::length(b.F_hand_W.force_N));
      }
      EXPECT_EQ(far.loop->fault(), master_station::Fault::kNone);
      EXPECT_LT(in_air_N, 0.2) << "the tool's own inertia, and no wall";
      EXPECT_GT(pressed_N, 2);
      EXPECT_LT(off_N, 1e-5) << by_m.x << " scaled " << scale;
      EXPECT_LT(off_m, 1e-8);
    }
  }
}

TEST(DevicePlace, WhereTheMiddlesAreTheOriginsNothingMoves) {
  const codecs::Exploration hints{.region_low_W = {-0.04, -0.03, -0.002}, .region_high_W = {0.04, 0.03, 0.002}};
  EXPECT_EQ(master_station::X_WB_before(hints, {0, 0, 0}, 3), spatial::Pose{});
}

/// Its workspace is not about its origin: there, half of any region was beyond a wall.
TEST(DevicePlace, TheHandBeginsInTheMiddleOfWhatTheDeviceReaches) {
  const DeviceModel& model = *find_model("inverse3");
  Moved moved({0.2, 0.3, 0.4}, 1, model);
  const glm::dvec3 p = moved.device->true_pose().p;
  EXPECT_TRUE(glm::all(glm::greaterThan(p, model.workspace_min_B_m + 0.05)));
  EXPECT_TRUE(glm::all(glm::lessThan(p, model.workspace_max_B_m - 0.05)));
}

}  // namespace
}  // namespace farfeel::devices
