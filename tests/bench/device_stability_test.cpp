#include "tests/bench/device_stability.h"

#include <gtest/gtest.h>

namespace farfeel::bench {
namespace {

using devices::DeviceModel;

TEST(DeviceStabilityTest, FindsTheLimitThatIsKnownInClosedForm) {
  // Without delay and filter the linear bound is K < b / (T/2); Colgate & Schenkel 1997.
  DeviceModel model = *devices::find_model("simulated");
  model.viscous_friction_Ns_per_m = 1;
  EXPECT_NEAR(stiffest_calm(model, Motion::kAlong, 0), 1 / 0.5e-3, 0.1 / 0.5e-3);
  model.viscous_friction_Ns_per_m = 2;
  EXPECT_NEAR(stiffest_calm(model, Motion::kAlong, 0), 2 / 0.5e-3, 0.1 * 2 / 0.5e-3);
}

TEST(DeviceStabilityTest, WhatIsTooStiffIsToldSoAndWhatIsSoftIsNot) {
  const DeviceModel& model = *devices::find_model("simulated-late");
  EXPECT_TRUE(is_calm(model, Motion::kAlong, {10, 0}));
  EXPECT_FALSE(is_calm(model, Motion::kAlong, {5000, 0.1}));
}

/// Of each model that is carried, and of the standard device without what its data states.
TEST(DeviceStabilityTest, WhatIsPickedIsCalmAndNoSofterThanItNeedBe) {
  std::vector<DeviceModel> models;
  for (const std::string& name : devices::model_names()) models.push_back(*devices::find_model(name));
  DeviceModel plain = *devices::find_model("simulated");
  plain.coupling_stiffness_N_per_m = plain.coupling_stiffness_Nm_per_rad = 0;
  models.push_back(plain);
  for (const DeviceModel& model : models) {
    for (const devices::Grasp hand : {devices::Grasp::kAny, devices::Grasp::kLimp}) {
      for (const DeviceRow& row : device_rows(model, hand)) {
        EXPECT_TRUE(row.is_calm) << row.device << " picks " << row.picked.stiffness << " of " << row.stiffest;
        EXPECT_TRUE(row.is_good()) << row.device << " picks " << row.picked.stiffness << " of " << row.stiffest;
      }
    }
  }
}

}  // namespace
}  // namespace farfeel::bench
