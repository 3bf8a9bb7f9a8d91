// The example plug-in, through the driver: force and torque have to reach the reading by the mechanics that it claims.
#include <gtest/gtest.h>
#include <time.h>

#include <cstdlib>
#include <filesystem>

#include "master_station/devices/driver/plug_in_driver.h"
#include "tests/support/private_folder.h"

namespace farfeel::devices {
namespace {

std::int64_t now_ns() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t(time.tv_sec) * 1'000'000'000 + time.tv_nsec;
}

class SimulatedHandle : public ::testing::Test {
 protected:
  void open(const std::string& path) {
    const auto found = find_plug_in_devices({.firmware = {}, .plug_in = path});
    ASSERT_EQ(found.size(), 1U);
    ASSERT_EQ(found[0].trouble, "");
    EXPECT_EQ(found[0].model, "simulated-handle");
    auto driver = open_plug_in_device(found[0], {});
    ASSERT_TRUE(driver) << driver.error().message;
    driver_ = std::move(*driver);
  }

  /// Steps until the handle rests under the wrench, by its own clock; false: it never does.
  bool settles(const spatial::Wrench& F_hand_B, bool is_force_on) {
    std::int64_t since_ns = 0, begin_ns = 0;
    for (int i = 0; i < 20'000; ++i) {
      const Command command{
          .time_ns = now_ns(), .F_hand_B = F_hand_B, .opening = 1, .is_force_on = is_force_on, .is_light_on = false};
      if (driver_->step(now_ns() + 2'000'000, command, newest_) != Stage::kReady) return false;
      if (begin_ns == 0) begin_ns = newest_.time_ns;
      const bool rests = glm::length(newest_.V_BD_B.linear_m_s) < 1e-5 &&
                         glm::length(newest_.V_BD_B.angular_rad_s) < 1e-4 && newest_.time_ns - begin_ns > 100'000'000;
      if (!rests) since_ns = newest_.time_ns;
      if (rests && newest_.time_ns - since_ns > 20'000'000) return true;
    }
    return false;
  }

  std::unique_ptr<Driver> driver_;
  Sample newest_;
};

TEST_F(SimulatedHandle, moves_as_its_springs_say) {
  open(std::string(FARFEEL_PLUG_INS) + "/simulated_handle.so");
  ASSERT_TRUE(settles({}, false));
  EXPECT_LT(glm::length(newest_.X_BD.p), 1e-6);
  const spatial::Wrench F{.torque_Nm = {0, 0.1, 0.2}, .force_N = {2, -3, 1}};
  ASSERT_TRUE(settles(F, true));
  const glm::dvec3 p_m = F.force_N / 200.0, turned_rad = F.torque_Nm / 0.5;  // f = k x
  EXPECT_LT(glm::length(newest_.X_BD.p - p_m), 2e-5);
  EXPECT_LT(glm::length(spatial::vector_from_rotation(newest_.X_BD.R) - turned_rad), 2e-4);
  ASSERT_TRUE(settles(F, false));
  EXPECT_LT(glm::length(newest_.X_BD.p), 2e-5);
  EXPECT_LT(glm::length(spatial::vector_from_rotation(newest_.X_BD.R)), 2e-4);
}

TEST_F(SimulatedHandle, stands_alone_as_its_first_lines_say) {
  const std::filesystem::path source = FARFEEL_EXAMPLE;
  const test_support::PrivateFolder folder;
  const std::string out = folder / "stand_alone.so";
  const std::string line = "cd '" + source.parent_path().string() + "' && cc -std=c99 -O2 -shared -fPIC -I.. -o '" +
                           out + "' simulated_handle.c -lm && chmod go-w '" + out + "'";
  if (std::system("cc --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "there is no cc on this machine";
  ASSERT_EQ(std::system(line.c_str()), 0) << line;
  open(out);
  ASSERT_TRUE(settles({.torque_Nm = {}, .force_N = {1, 0, 0}}, true));
}

}  // namespace
}  // namespace farfeel::devices
