#include "master_station/devices/model/device_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "master_station/devices/model/known_devices.h"
#include "tests/support/private_folder.h"

namespace farfeel::devices {
namespace {

class DeviceFileTest : public ::testing::Test {
 protected:
  test_support::PrivateFolder private_folder;
  const std::string folder = private_folder.path();
  const DeviceModel& model = *find_model("simulated-late");
};

DeviceFile turned(const DeviceModel& model) {
  DeviceFile device{model, {}};
  device.model.coupling_stiffness_N_per_m = 812.5;
  device.model.viscous_friction_Ns_per_m = 0.1 + 0.2;
  device.model.workspace_min_B_m = {-0.1, -0.2, -0.3};
  device.calibration.R_BA = glm::dmat3(glm::dvec3(0, 1, 0), glm::dvec3(-1, 0, 0), glm::dvec3(0, 0, 1));
  device.calibration.offset_B_m = {0.01, 0, -0.02};
  device.calibration.units_per_N = 0.255;
  device.calibration.gravity_B_N = {0, 0, 0.6};
  device.calibration.neutral = {{0.01, 0, 0}, {0, -0.02, 0}};
  return device;
}

TEST_F(DeviceFileTest, WhatIsWrittenIsReadAgain) {
  const std::string path = folder + "/below/" + device_file_name(model.name, "A1");
  const DeviceFile device = turned(model);
  ASSERT_TRUE(write_device_file(path, device, model));
  const auto read = read_device_file(path, model);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->calibration, device.calibration);
  EXPECT_EQ(read->model.coupling_stiffness_N_per_m, 812.5);
  EXPECT_EQ(read->model.viscous_friction_Ns_per_m, 0.1 + 0.2);
  EXPECT_EQ(read->model.workspace_min_B_m, device.model.workspace_min_B_m);
  EXPECT_EQ(read->model.mass_kg, model.mass_kg);
  for (const auto& entry : std::filesystem::directory_iterator(folder + "/below"))
    EXPECT_EQ(entry.path(), path) << "nothing is left beside it";
}

TEST_F(DeviceFileTest, WithoutAFileTheModelIsAsItIs) {
  const auto read = read_device_file(folder + "/none.toml", model);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->calibration, Calibration{});
  EXPECT_EQ(read->model.mass_kg, model.mass_kg);
  EXPECT_FALSE(read_device_file(folder, model)) << "a folder is none";
}

TEST_F(DeviceFileTest, UnreasonableCalibrationsAreRefusedWithFigureAndUnit) {
  const auto complaint = [&](const std::string& line) {
    const auto read = parse_device_file("[calibration]\n" + line, "d.toml", model);
    return read ? std::string() : read.error().message;
  };
  EXPECT_EQ(complaint("axes = [\"+x\", \"-z\", \"+y\"]"), "");
  EXPECT_NE(complaint("axes = [\"+x\", \"+z\", \"+y\"]").find("right-handed"), std::string::npos);
  EXPECT_NE(complaint("axes = [\"+x\", \"+x\", \"+y\"]").find("d.toml:2: calibration.axes"), std::string::npos);
  EXPECT_NE(complaint("axes = [\"+x\"]").find("axes"), std::string::npos);
  EXPECT_NE(complaint("offset_m = [3, 0, 0]").find("is 3 m long; more than 1 m"), std::string::npos);
  EXPECT_NE(complaint("gravity_N = [0, 0, 5]").find("5 N long; more than 3 N"), std::string::npos);
  EXPECT_NE(complaint("gravity_N = [0, 0, nan]").find("gravity_N"), std::string::npos);
  EXPECT_NE(complaint("neutral_push = [0.9, 0, 0]").find("of full travel"), std::string::npos);
  EXPECT_FALSE(parse_device_file(std::string(kDeviceFileBytesMax + 1, '\n'), "d.toml", model));
  DeviceFile bad = turned(model);
  bad.calibration.gravity_B_N = {0, 0, 50};
  EXPECT_FALSE(write_device_file(folder + "/bad.toml", bad, model));
  EXPECT_FALSE(std::filesystem::exists(folder + "/bad.toml"));
}

TEST_F(DeviceFileTest, NoSerialNumberLeavesTheFolder) {
  EXPECT_EQ(device_file_name("falcon", "AB-12_c"), "falcon-AB-12_c.toml");
  EXPECT_EQ(device_file_name("falcon", "../../etc/passwd"), "falcon-%2E%2E%2F%2E%2E%2Fetc%2Fpasswd.toml");
  EXPECT_EQ(device_file_name("falcon", std::string("a\0b\n", 4)), "falcon-a%00b%0A.toml");
  const std::string longest(1000, '/');
  EXPECT_LT(device_file_name("m", longest).size(), 255u);
  EXPECT_NE(device_file_name("m", longest), device_file_name("m", longest + "x"));
  EXPECT_NE(device_file_name("m", "%2E"), device_file_name("m", "."));
}

TEST_F(DeviceFileTest, ADeviceIsKnownUntilItIsCalibratedAnew) {
  DeviceFile device = turned(model);
  EXPECT_FALSE(is_known_device(folder + "/state", "A1", device));
  ASSERT_TRUE(remember_device(folder + "/state", "A1", device));
  EXPECT_TRUE(is_known_device(folder + "/state", "A1", device));
  EXPECT_FALSE(is_known_device(folder + "/state", "A2", device));
  device.calibration.offset_B_m.x += 1e-9;
  EXPECT_FALSE(is_known_device(folder + "/state", "A1", device));
}

TEST(CalibrationTest, PowerIsTheSameInBothFrames) {
  Calibration calibration;
  calibration.R_BA = glm::dmat3(glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0));
  calibration.offset_B_m = {1, 2, 3};
  Sample in_A;
  in_A.X_BD = {spatial::rotation_from_vector({0.1, 0.2, -0.3}), {0.1, 0.2, 0.3}};
  in_A.V_BD_B = {{1, 2, 3}, {4, 5, 6}};
  in_A.deflection.push = {0.5, -2, 0};
  const Sample in_B = calibrated(calibration, in_A);
  EXPECT_EQ(in_B.X_BD.p, calibration.R_BA * in_A.X_BD.p + calibration.offset_B_m);
  EXPECT_LT(glm::length(spatial::vector_from_rotation(in_B.X_BD.R) - glm::dvec3(-0.3, 0.1, 0.2)), 1e-12);
  EXPECT_LE(glm::length(in_B.deflection.push - glm::dvec3(0, 0.5, -1)), 1e-15);
  const spatial::Wrench F_B{{0.1, 0.5, -0.2}, {1, -2, 4}};
  EXPECT_NEAR(spatial::power_W(F_B, in_B.V_BD_B), spatial::power_W(for_device(calibration, F_B), in_A.V_BD_B), 1e-12);
}

}  // namespace
}  // namespace farfeel::devices
