#include "master_station/devices/model/device_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "master_station/devices/model/built_in_models.h"
#include "master_station/devices/model/figures.h"

namespace farfeel::devices {
namespace {

constexpr std::string_view kMinimal =
    "title = \"T\"\nforce_dof = 3\nposition_dof = 3\nmass_kg = 0.2\nmax_force_N = 5\n";

std::string complaint(std::string_view toml) {
  const auto model = parse_model(toml, "m.toml");
  return model ? "" : model.error().message;
}

TEST(DeviceModelTest, EveryModelThatIsCarriedIsReadAndNamed) {
  ASSERT_FALSE(kBuiltInModels.empty());
  for (const BuiltInModel& each : kBuiltInModels) {
    const auto model = parse_model(each.toml, each.name);
    ASSERT_TRUE(model) << model.error().message;
    const DeviceModel* found = find_model(each.name);
    ASSERT_NE(found, nullptr);
    EXPECT_EQ(found->name, each.name);
    EXPECT_FALSE(found->title.empty()) << each.name;
  }
  EXPECT_EQ(model_names().size(), kBuiltInModels.size());
  EXPECT_EQ(find_model("no such thing"), nullptr);
}

TEST(DeviceModelTest, TheStandardDeviceHasTheFiguresThatAllKeptResultsRestOn) {
  const DeviceModel& model = *find_model("simulated");
  EXPECT_EQ(model.mass_kg, 0.15);
  EXPECT_EQ(model.inertia_kg_m2, 2e-4);
  EXPECT_EQ(model.position_step_m, 20e-6);
  EXPECT_EQ(model.rotation_step_rad, 1e-4);
  EXPECT_EQ(model.viscous_friction_Nms_per_rad, 0.006);
  EXPECT_EQ(model.rate_Hz, 0);
  EXPECT_EQ(model.sensor_delay_s + model.actuator_delay_s, 0);
}

TEST(DeviceModelTest, EveryFigureIsReadIntoItsOwnPlaceAndRefusedBeyondItsLimits) {
  for (const Figure& figure : kFigures) {
    const double low = std::max(figure.least, 0.0), high = std::min(figure.most, 1e6);
    const double value = low + 0.25 * (high - low);
    DeviceModel base;  // so that what is checked together is in order
    base.max_force_N = base.max_torque_Nm = 1e6;
    base.force_dof = base.torque_dof = 3;
    base.mass_kg = base.inertia_kg_m2 = 1;
    const auto line = [&](double v) { return std::string(figure.key) + " = " + std::to_string(v); };
    const auto read = parse_model(line(value), "m.toml", base);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_NEAR((*read).*figure.member, value, 1e-6) << figure.key;
    int changed = 0;
    for (const Figure& other : kFigures) changed += (*read).*other.member != base.*other.member;
    EXPECT_LE(changed, 1) << figure.key;
    const auto refused = parse_model(line(figure.least - 1), "m.toml", base);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("m.toml:1: " + std::string(figure.key)), std::string::npos)
        << refused.error().message;
    EXPECT_FALSE(parse_model(std::string(figure.key) + " = nan", "m.toml", base));
    if (std::isfinite(figure.most)) {
      EXPECT_FALSE(parse_model(line(2 * figure.most), "m.toml", base));
      EXPECT_FALSE(parse_model(std::string(figure.key) + " = inf", "m.toml", base));
    }
  }
}

TEST(DeviceModelTest, WhatIsNotNamedStaysAsInTheBase) {
  DeviceModel base;
  base.mass_kg = 0.5;
  base.estimated = {"mass_kg"};
  const auto model = parse_model("coulomb_friction_N = 1\n", "m.toml", base);
  ASSERT_TRUE(model);
  EXPECT_EQ(model->mass_kg, 0.5);
  EXPECT_TRUE(model->is_estimated("mass_kg"));
  EXPECT_FALSE(model->is_estimated("coulomb_friction_N"));
}

TEST(DeviceModelTest, ComplaintsNameFileLineFigureAndWhatIsAllowed) {
  EXPECT_EQ(complaint(kMinimal), "");
  EXPECT_NE(complaint("mass = 1").find("unknown key mass"), std::string::npos);
  EXPECT_NE(complaint("mass_kgg = 1").find("did you mean mass_kg?"), std::string::npos);
  EXPECT_NE(complaint("\nmass_kg = \"x\"").find("m.toml:2: mass_kg must be a number from 0 to 20"), std::string::npos);
  EXPECT_NE(complaint("force_dof = 4").find("a whole number from 0 to 3"), std::string::npos);
  EXPECT_NE(complaint("tells = \"poses\"").find("\"pose\", \"rate\""), std::string::npos);
  EXPECT_NE(complaint("estimated = [\"weight\"]").find("names weight"), std::string::npos);
  EXPECT_NE(complaint("[a").find("m.toml:1: not TOML"), std::string::npos);
  EXPECT_NE(complaint("max_force_N = 2\ncontinuous_force_N = 3").find("3 N and max_force_N 2 N"), std::string::npos);
  EXPECT_NE(complaint("force_dof = 3\nmax_force_N = 3").find("mass_kg"), std::string::npos);
  EXPECT_NE(complaint("workspace_min_B_m = [0.1, 0, 0]").find("in metres"), std::string::npos);
  EXPECT_NE(complaint("enabling = \"hold\"").find("enable_button"), std::string::npos);
}

}  // namespace
}  // namespace farfeel::devices
