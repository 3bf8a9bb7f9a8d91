// The plug-in for Force Dimension's library, through the driver, against an imitation of that library.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <time.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "master_station/devices/driver/plug_in_driver.h"
#include "tests/support/devices/plug_ins/imitation_libdhd.h"

namespace farfeel::devices {
namespace {

const std::string kPlugIn = std::string(FARFEEL_PLUG_INS) + "/force_dimension.so";
const std::string kImitation = std::string(FARFEEL_TEST_PLUG_INS) + "/imitation_libdhd.so";
const std::string kOld = std::string(FARFEEL_TEST_PLUG_INS) + "/old_libdhd.so";

std::int64_t now_ns() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t(time.tv_sec) * 1'000'000'000 + time.tv_nsec;
}

class ForceDimension : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("FARFEEL_DHD_LIBRARY", kImitation.c_str(), 1);
    void* const handle = dlopen(kImitation.c_str(), RTLD_NOW | RTLD_LOCAL);
    ASSERT_NE(handle, nullptr) << dlerror();
    is_ = reinterpret_cast<decltype(&imitation)>(dlsym(handle, "imitation"))();
    *is_ = {};
    is_->count = 3;
    const int types[] = {33, 36, 104};
    for (int i = 0; i < 3; ++i) {
      imitated_device& device = is_->devices[i];
      device.type = types[i];
      device.serial = static_cast<unsigned short>(100 + i);
      device.is_powered_up = device.wrist_is_initialised = device.brakes_are_on = 1;
      for (int j = 0; j < 3; ++j) device.frame_F[j][j] = 1;
    }
  }
  void TearDown() override {
    driver_.reset();
    unsetenv("FARFEEL_DHD_LIBRARY");
  }

  static std::vector<FoundDevice> find() { return find_plug_in_devices({.firmware = {}, .plug_in = kPlugIn}); }
  void open(std::size_t index) {
    auto driver = open_plug_in_device(find().at(index), {});
    ASSERT_TRUE(driver) << driver.error().message;
    driver_ = std::move(*driver);
  }
  Stage step(const glm::dvec3& force_N, const glm::dvec3& torque_Nm = glm::dvec3(0)) {
    const Command command{.time_ns = now_ns(),
                          .F_hand_B = {.torque_Nm = torque_Nm, .force_N = force_N},
                          .opening = 1,
                          .is_force_on = true,
                          .is_light_on = false};
    return driver_->step(now_ns() + 1'000'000, command, newest_);
  }
  Stage rest() { return driver_->step(now_ns() + 1'000'000, {}, newest_); }

  imitated_libdhd* is_ = nullptr;
  std::unique_ptr<Driver> driver_;
  Sample newest_;
};

void expect_force(const double (&told)[3], const glm::dvec3& expected) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(told[i], expected[i], 1e-12) << "axis " << i;
}

TEST_F(ForceDimension, is_found_by_kind_and_serial_number) {
  const auto found = find();
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].model, "omega-3");
  EXPECT_EQ(found[1].model, "omega-6");
  EXPECT_EQ(found[2].model, "sigma-7");
  EXPECT_EQ(found[2].serial, "102");
  for (const imitated_device& device : is_->devices) {
    EXPECT_FALSE(device.is_open);       // finding leaves nothing open,
    EXPECT_TRUE(device.brakes_are_on);  // and nothing moved
    EXPECT_FALSE(device.force_is_enabled);
  }
  open(1);
  EXPECT_EQ(find().at(1).serial, "101");  // while it is open
  EXPECT_TRUE(is_->devices[1].is_open);
}

TEST_F(ForceDimension, what_it_tells_of_itself_fits_its_kind) {
  const auto expect_says = [&](const char* line) {
    EXPECT_NE(driver_->model_toml().find(line), std::string::npos) << line << " is not in\n" << driver_->model_toml();
  };
  open(0);
  for (const char* line : {"rotation_dof = 0", "torque_dof = 0", "max_force_N = 12.0", "holds_force_s = 0.02"})
    expect_says(line);
  EXPECT_EQ(is_->devices[0].watchdog, 160);  // 20 ms
  EXPECT_EQ(is_->is_expert, 0);
  driver_.reset();
  open(1);
  for (const char* line : {"rotation_dof = 3", "torque_dof = 0", "left-handed"}) expect_says(line);
  driver_.reset();
  open(2);
  for (const char* line : {"rotation_dof = 3", "torque_dof = 3", "max_torque_Nm = 0.4"}) expect_says(line);
}

TEST_F(ForceDimension, frames_are_turned_to_ours) {
  open(2);
  imitated_device& device = is_->devices[2];
  // Theirs: x towards the person, y right, z up. 10 mm towards the person, 20 to the right, 30 up.
  const double at[] = {0.01, 0.02, 0.03}, v[] = {0.1, 0.2, 0.3}, w[] = {1, 2, 3};
  for (int i = 0; i < 3; ++i)
    device.rest_F_m[i] = at[i], device.velocity_F_m_s[i] = v[i], device.angular_velocity_F_rad_s[i] = w[i];
  // A turn by 0.3 rad about their x, which points at the person: about our -y.
  const double c = std::cos(0.3), s = std::sin(0.3);
  const double about_x[3][3] = {{1, 0, 0}, {0, c, -s}, {0, s, c}};
  std::copy(&about_x[0][0], &about_x[0][0] + 9, &device.frame_F[0][0]);
  ASSERT_EQ(rest(), Stage::kReady) << driver_->advice();
  const auto near = [](const glm::dvec3& a, const glm::dvec3& b) { return glm::length(a - b) < 1e-12; };
  EXPECT_TRUE(near(newest_.X_BD.p, {0.02, -0.01, 0.03}));
  EXPECT_TRUE(near(newest_.V_BD_B.linear_m_s, {0.2, -0.1, 0.3}));
  EXPECT_TRUE(near(newest_.V_BD_B.angular_rad_s, {2, -1, 3}));
  EXPECT_TRUE(near(spatial::vector_from_rotation(newest_.X_BD.R), {0, -0.3, 0}));

  ASSERT_EQ(step({1, 2, 3}, {0.1, 0.2, 0.15}), Stage::kReady);
  expect_force(device.force_F_N, {-2, 1, 3});
  expect_force(device.torque_F_Nm, {-0.2, 0.1, 0.15});
  EXPECT_EQ(device.grip_N, 0);
  ASSERT_EQ(step({1, 2, 3}), Stage::kReady);  // pushed along our force: the reading moves along it
  EXPECT_TRUE(near(newest_.X_BD.p, glm::dvec3(0.02, -0.01, 0.03) + glm::dvec3(1, 2, 3) / kImitatedStiffness_N_per_m));
}

TEST_F(ForceDimension, turns_by_any_angle_come_through) {
  open(2);
  for (int i = 0; i < 200; ++i) {
    const glm::dvec3 axis = glm::normalize(glm::dvec3(std::sin(1.0 * i), std::cos(2.3 * i), std::sin(0.7 * i + 1)));
    const glm::dquat q_F = glm::angleAxis(3.14159 * double(i) / 199, axis);
    const glm::dmat3 R = glm::mat3_cast(q_F);  // R[column][row]
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) is_->devices[2].frame_F[row][column] = R[column][row];
    ASSERT_EQ(rest(), Stage::kReady) << driver_->advice();
    const glm::dquat expected(q_F.w, q_F.y, -q_F.x, q_F.z);
    EXPECT_NEAR(std::abs(glm::dot(expected, newest_.X_BD.R)), 1, 1e-12) << i;
  }
}

TEST_F(ForceDimension, brakes_open_with_the_first_force_and_close_at_the_end) {
  open(0);
  imitated_device& device = is_->devices[0];
  for (int i = 0; i < 3; ++i) ASSERT_EQ(rest(), Stage::kReady);
  EXPECT_TRUE(device.brakes_are_on);
  EXPECT_FALSE(device.force_is_enabled);
  step({1, 0, 0});
  EXPECT_FALSE(device.brakes_are_on);
  EXPECT_TRUE(device.force_is_enabled);
  rest();
  expect_force(device.force_F_N, glm::dvec3(0));
  EXPECT_FALSE(device.brakes_are_on);  // not closed and opened with every pause of the force
  step({1, 0, 0});
  driver_.reset();
  expect_force(device.force_F_N, glm::dvec3(0));
  EXPECT_TRUE(device.brakes_are_on);
  EXPECT_FALSE(device.force_is_enabled);
  EXPECT_FALSE(device.is_open);
}

TEST_F(ForceDimension, three_degrees_of_freedom_get_no_torque_and_tell_no_orientation) {
  open(0);
  rest();
  ASSERT_EQ(step({0, 0, 20}, {1, 1, 1}), Stage::kReady);
  expect_force(is_->devices[0].force_F_N, {0, 0, 12});
  expect_force(is_->devices[0].torque_F_Nm, glm::dvec3(0));
  is_->devices[0].frame_F[0][0] = std::numeric_limits<double>::quiet_NaN();  // what is not there is not looked at
  ASSERT_EQ(step({0, 0, 20}), Stage::kReady);                                // a saturated motor is no error
  EXPECT_EQ(newest_.X_BD.R, glm::dquat(1, 0, 0, 0));
}

TEST_F(ForceDimension, a_grip_that_closes_is_a_button) {
  open(2);
  is_->devices[2].button = 1;
  rest();
  EXPECT_TRUE(newest_.has_button(0));
  driver_.reset();
  open(1);
  rest();
  EXPECT_FALSE(newest_.has_button(0));
  is_->devices[1].button = 1;
  rest();
  EXPECT_TRUE(newest_.has_button(0));
}

TEST_F(ForceDimension, no_call_that_fails_leaves_force_on) {
  for (const char* call : {"dhdGetPositionAndOrientationFrame", "dhdSetForceAndTorqueAndGripperForce", "dhdGetButton",
                           "dhdGetStatus", "*"}) {
    SCOPED_TRACE(call);
    driver_.reset();
    SetUp();
    open(0);
    rest();
    step({1, 0, 0});
    is_->failing = call;
    Stage stage = Stage::kReady;
    for (int i = 0; i < 70 && stage == Stage::kReady; ++i) stage = step({1, 0, 0});  // the status is seldom asked for
    EXPECT_EQ(stage, Stage::kFault);
    EXPECT_NE(driver_->advice().find("communication error"), std::string::npos) << driver_->advice();
    is_->has_failed = 1, is_->largest_force_after_failure_N = 0;
    for (int i = 0; i < 10; ++i) EXPECT_NE(step({1, 0, 0}), Stage::kReady);
    is_->failing = nullptr;
    for (int i = 0; i < 10; ++i) step({1, 0, 0});  // it is back, but nobody let go of the force yet
    EXPECT_EQ(is_->largest_force_after_failure_N, 0);
    EXPECT_TRUE(is_->devices[0].brakes_are_on);
    EXPECT_EQ(rest(), Stage::kReady);
    EXPECT_EQ(step({1, 0, 0}), Stage::kReady);
    EXPECT_FALSE(is_->devices[0].brakes_are_on);
    expect_force(is_->devices[0].force_F_N, {0, 1, 0});
  }
}

TEST_F(ForceDimension, motors_that_do_not_come_on_are_a_fault) {
  for (const char* call : {"dhdEnableForce", "dhdSetBrakes"}) {
    driver_.reset();
    SetUp();
    open(0);
    rest();
    is_->failing = call;
    EXPECT_EQ(step({1, 0, 0}), Stage::kFault);
    expect_force(is_->devices[0].force_F_N, glm::dvec3(0));
  }
}

TEST_F(ForceDimension, a_device_that_stays_silent_is_gone) {
  open(0);
  rest();
  is_->failing = "*";
  const std::int64_t begin_ns = now_ns();
  Stage stage = Stage::kReady;
  while (stage != Stage::kAbsent && now_ns() - begin_ns < 10'000'000'000) stage = step({1, 0, 0});
  EXPECT_EQ(stage, Stage::kAbsent);
}

TEST_F(ForceDimension, power_reset_and_wrist_are_told_to_a_person) {
  open(2);
  imitated_device& device = is_->devices[2];
  device.wrist_is_initialised = 0;
  EXPECT_EQ(rest(), Stage::kHoming);
  EXPECT_NE(driver_->advice().find("calibration pose"), std::string::npos);
  device.wrist_is_initialised = 1, device.needs_reset = 1;
  EXPECT_EQ(rest(), Stage::kHoming);
  device.needs_reset = 0, device.is_powered_up = 0;
  EXPECT_EQ(rest(), Stage::kFault);
  EXPECT_NE(driver_->advice().find("no power"), std::string::npos);
  device.is_powered_up = 1, device.has_error = 1;
  EXPECT_EQ(rest(), Stage::kFault);
  device.has_error = 0;
  EXPECT_EQ(rest(), Stage::kReady);
  step({1, 0, 0});
  device.forgets_force = 1;  // its own limit of speed
  Stage stage = Stage::kReady;
  for (int i = 0; i < 70 && stage == Stage::kReady; ++i) stage = step({1, 0, 0});
  EXPECT_EQ(stage, Stage::kFault);
  EXPECT_NE(driver_->advice().find("cause 2"), std::string::npos);
  EXPECT_TRUE(device.brakes_are_on);
}

TEST_F(ForceDimension, a_reading_that_was_kept_back_is_no_report) {
  open(0);
  rest();
  const std::uint64_t reports = newest_.reports;
  const std::int64_t time_ns = newest_.time_ns;
  is_->result_of_reading = 1;
  EXPECT_EQ(rest(), Stage::kReady);
  EXPECT_EQ(newest_.reports, reports);
  EXPECT_EQ(newest_.time_ns, time_ns);
  EXPECT_GT(newest_.polled_ns, time_ns);
}

TEST_F(ForceDimension, velocity_is_estimated_where_the_library_has_none) {
  open(0);
  is_->failing = "dhdGetLinearVelocity";
  for (int i = 0; i < 5; ++i) ASSERT_EQ(rest(), Stage::kReady) << driver_->advice();
  EXPECT_EQ(newest_.V_BD_B.linear_m_s, glm::dvec3(0));
}

TEST_F(ForceDimension, nonsense_of_the_library_is_a_fault) {
  open(2);
  rest();
  step({1, 0, 0});
  is_->devices[2].frame_F[1][1] = 2;  // no rotation
  EXPECT_EQ(step({1, 0, 0}), Stage::kFault);
  is_->devices[2].frame_F[1][1] = 1;
  EXPECT_EQ(step({1, 0, 0}), Stage::kFault);
  expect_force(is_->devices[2].force_F_N, glm::dvec3(0));
}

TEST_F(ForceDimension, a_library_that_lacks_says_so) {
  setenv("FARFEEL_DHD_LIBRARY", kOld.c_str(), 1);
  auto found = find();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NE(found[0].trouble.find("dhdGetAngularVelocityRad"), std::string::npos) << found[0].trouble;
  EXPECT_FALSE(open_plug_in_device(found[0], {}));
  setenv("FARFEEL_DHD_LIBRARY", "/nowhere/libdhd.so", 1);
  found = find();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NE(found[0].trouble.find("install their SDK"), std::string::npos) << found[0].trouble;
  EXPECT_FALSE(open_plug_in_device(found[0], {}));
}

TEST_F(ForceDimension, a_device_in_use_or_unknown_says_so) {
  is_->failing = "dhdOpenID";
  EXPECT_NE(find().at(0).trouble.find("another program"), std::string::npos);
  is_->failing = nullptr;
  is_->devices[0].type = 4711;
  EXPECT_EQ(find().at(0).model, "force-dimension");
  EXPECT_FALSE(open_plug_in_device(find().at(0), {}));
  EXPECT_FALSE(is_->devices[0].is_open);
}

}  // namespace
}  // namespace farfeel::devices
