#include "master_station/devices/driver/plug_in_driver.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>

#include "tests/support/devices/plug_ins/obedient_plug_in.h"
#include "tests/support/private_folder.h"

namespace farfeel::devices {
namespace {

const std::string kFolder = FARFEEL_TEST_PLUG_INS;
const std::string kObedient = kFolder + "/obedient_plug_in.so";
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

std::int64_t now_ns() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t(time.tv_sec) * 1'000'000'000 + time.tv_nsec;
}

class PlugInDriver : public ::testing::Test {
 protected:
  void SetUp() override {
    void* const handle = dlopen(kObedient.c_str(), RTLD_NOW | RTLD_LOCAL);
    ASSERT_NE(handle, nullptr) << dlerror();
    is_ = reinterpret_cast<decltype(&obedience)>(dlsym(handle, "obedience"))();
    *is_ = {};
    is_->devices = 1;
    is_->stage = FARFEEL_DEVICE_READY;
    is_->zero_force_result = FARFEEL_DEVICE_FAILED;
    std::strcpy(is_->found.model, "test-device");
    std::strcpy(is_->found.serial, "007");
    std::strcpy(is_->found.id, "a");
    auto& says = is_->description;
    std::strcpy(says.title, "Test \"device\"");
    std::strcpy(says.estimated, "mass_kg, sensor_delay_s");
    says.position_dof = says.rotation_dof = says.force_dof = says.torque_dof = 3;
    says.is_in_newtons = 1;
    says.enable_button = 0;
    says.clutch_button = -1;
    for (int i = 0; i < 3; ++i) says.workspace_min_B_m[i] = -0.1, says.workspace_max_B_m[i] = 0.1;
    says.position_step_m = says.rotation_step_rad = 1e-5;
    says.rate_Hz = 1000;
    says.mass_kg = 0.1, says.inertia_kg_m2 = 1e-4;
    says.holds_force_s = kInf;
    says.max_force_N = 5, says.continuous_force_N = 3, says.max_torque_Nm = 0.5, says.continuous_torque_Nm = 0.2;
    is_->sample.orientation[0] = 1;
    is_->sample.has_velocity = 1;
  }

  std::vector<FoundDevice> find() { return find_plug_in_devices({.firmware = {}, .plug_in = kObedient}); }

  std::unique_ptr<Driver> open() {
    const auto found = find();
    if (found.size() != 1 || !found[0].trouble.empty()) {
      ADD_FAILURE() << (found.empty() ? "nothing found" : found[0].trouble);
      return nullptr;
    }
    auto driver = open_plug_in_device(found[0], {});
    EXPECT_TRUE(driver) << (driver ? "" : driver.error().message);
    return driver ? std::move(*driver) : nullptr;
  }

  std::string trouble_in_opening() {
    const auto found = find();
    const auto driver = open_plug_in_device(found.at(0), {});
    return driver ? "" : driver.error().message;
  }

  static Command pushing(const glm::dvec3& force_N, const glm::dvec3& torque_Nm = glm::dvec3(0)) {
    return {.time_ns = now_ns(),
            .F_hand_B = {.torque_Nm = torque_Nm, .force_N = force_N},
            .opening = 1,
            .is_force_on = true,
            .is_light_on = false};
  }

  Stage step(Driver& driver, const Command& command = {}) {
    return driver.step(now_ns() + 1'000'000, command, newest_);
  }

  bool feels_nothing() const {
    for (int i = 0; i < 3; ++i)
      if (is_->command.force_B_N[i] != 0 || is_->command.torque_B_Nm[i] != 0) return false;
    return is_->command.is_force_on == 0;
  }

  farfeel_obedience* is_ = nullptr;
  Sample newest_;
};

void expect_says(const std::string& message, const std::string& what) {
  EXPECT_NE(message.find(what), std::string::npos) << "\"" << message << "\" does not say \"" << what << "\"";
}

TEST_F(PlugInDriver, tells_all_of_a_device) {
  const auto driver = open();
  EXPECT_EQ(driver->identity().model, "test-device");
  EXPECT_EQ(driver->identity().serial, "007");
  EXPECT_EQ(driver->identity().path, std::filesystem::canonical(kObedient).string() + "#a");
  EXPECT_STREQ(is_->opened.id, "a");
  EXPECT_STREQ(is_->opened.model, "test-device");
  const std::string toml = driver->model_toml();
  for (const char* line : {"title = \"Test \\\"device\\\"\"", "holds_force_s = inf", "max_force_N = 5.0",
                           "force_dof = 3", "enabling = \"hold\"", "estimated = [\"mass_kg\", \"sensor_delay_s\"]",
                           "workspace_min_B_m = [-0.1, -0.1, -0.1]"})
    expect_says(toml, line);

  auto& sample = is_->sample;
  sample.time_ns = now_ns(), sample.seen_ns = sample.time_ns, sample.reports = 7, sample.buttons = 5;
  sample.orientation[0] = sample.orientation[3] = std::sqrt(0.5);
  for (int i = 0; i < 3; ++i) {
    sample.position_m[i] = 0.01 * (i + 1), sample.velocity_m_s[i] = 0.1 * (i + 1);
    sample.angular_velocity_rad_s[i] = i + 1, sample.turn[i] = -0.1 * i, sample.push[i] = 0.2 * i;
  }
  EXPECT_EQ(step(*driver), Stage::kReady);
  EXPECT_EQ(newest_.stage, Stage::kReady);
  EXPECT_EQ(newest_.time_ns, sample.time_ns);
  EXPECT_EQ(newest_.polled_ns, sample.seen_ns);
  EXPECT_EQ(newest_.reports, 7U);
  EXPECT_EQ(newest_.buttons, 5U);
  EXPECT_EQ(newest_.X_BD.p, glm::dvec3(0.01, 0.02, 0.03));
  const glm::dvec3 turned = newest_.X_BD.R * glm::dvec3(1, 0, 0);  // a quarter about z
  EXPECT_NEAR(turned.x, 0, 1e-12);
  EXPECT_NEAR(turned.y, 1, 1e-12);
  EXPECT_EQ(newest_.V_BD_B.linear_m_s, glm::dvec3(0.1, 0.2, 0.1 * 3));
  EXPECT_EQ(newest_.V_BD_B.angular_rad_s, glm::dvec3(1, 2, 3));
  EXPECT_EQ(newest_.deflection.push, glm::dvec3(0, 0.2, 0.4));
  EXPECT_EQ(newest_.deflection.turn, glm::dvec3(0, -0.1, -0.2));
  EXPECT_EQ(driver->advice(), "");
  EXPECT_FALSE(driver->zero_force());
}

TEST_F(PlugInDriver, closes_what_it_opened) {
  open().reset();
  EXPECT_EQ(is_->opens, 1);
  EXPECT_EQ(is_->closes, 1);
  is_->description.rate_Hz = kNan;
  trouble_in_opening();
  EXPECT_EQ(is_->opens, 2);
  EXPECT_EQ(is_->closes, 2);
}

TEST_F(PlugInDriver, caps_force_and_torque_and_keeps_their_direction) {
  const auto driver = open();
  step(*driver);
  step(*driver, pushing({1, 2, 2}, {0.1, 0, 0}));
  EXPECT_EQ(is_->command.is_force_on, 1);
  EXPECT_EQ(is_->command.force_B_N[1], 2);
  EXPECT_EQ(is_->command.torque_B_Nm[0], 0.1);
  for (const double scale : {10.0, 1e10, 1e300}) {
    step(*driver, pushing(scale * glm::dvec3(1, 2, 2), scale * glm::dvec3(0, -1, 0)));
    EXPECT_NEAR(is_->command.force_B_N[0], 5.0 / 3, 1e-12);
    EXPECT_NEAR(is_->command.force_B_N[1], 10.0 / 3, 1e-12);
    EXPECT_NEAR(is_->command.force_B_N[2], 10.0 / 3, 1e-12);
    EXPECT_NEAR(is_->command.torque_B_Nm[1], -0.5, 1e-12);
  }
}

TEST_F(PlugInDriver, a_command_that_is_not_finite_is_no_force) {
  const auto driver = open();
  step(*driver);
  for (const double bad : {kNan, kInf, -kInf}) {
    step(*driver, pushing({0, bad, 0}));
    EXPECT_TRUE(feels_nothing());
    step(*driver, pushing({0, 1, 0}, {0, 0, bad}));
    EXPECT_TRUE(feels_nothing());
  }
}

TEST_F(PlugInDriver, masks_force_that_the_device_lacks) {
  is_->description.torque_dof = 0, is_->description.max_torque_Nm = 0, is_->description.continuous_torque_Nm = 0;
  const auto driver = open();
  step(*driver);
  step(*driver, pushing({1, 0, 0}, {1, 1, 1}));
  EXPECT_EQ(is_->command.force_B_N[0], 1);
  for (const double torque_Nm : is_->command.torque_B_Nm) EXPECT_EQ(torque_Nm, 0);
}

TEST_F(PlugInDriver, force_waits_for_ready_and_after_a_fault_for_a_command_without_it) {
  const auto driver = open();
  step(*driver, pushing({1, 0, 0}));
  EXPECT_TRUE(feels_nothing());  // not known to be ready yet
  step(*driver, pushing({1, 0, 0}));
  EXPECT_FALSE(feels_nothing());
  for (const int stage : {FARFEEL_DEVICE_FAULT, FARFEEL_DEVICE_HOMING, FARFEEL_DEVICE_OPENING}) {
    is_->stage = stage;
    step(*driver, pushing({1, 0, 0}));  // it tells the stage with this one's answer
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(step(*driver, pushing({1, 0, 0})), static_cast<Stage>(stage));
      EXPECT_TRUE(feels_nothing());
    }
    is_->stage = FARFEEL_DEVICE_READY;
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(step(*driver, pushing({1, 0, 0})), Stage::kReady);
      EXPECT_TRUE(feels_nothing());
    }
    step(*driver);
    step(*driver, pushing({1, 0, 0}));
    EXPECT_FALSE(feels_nothing());
  }
}

TEST_F(PlugInDriver, what_no_device_can_tell_is_a_fault_for_good) {
  const std::pair<const char*, std::function<void()>> lies[] = {
      {"position", [&] { is_->sample.position_m[1] = kNan; }},
      {"position", [&] { is_->sample.position_m[2] = 11; }},
      {"position", [&] { is_->sample.position_m[0] = -kInf; }},
      {"orientation", [&] { is_->sample.orientation[0] = 0; }},
      {"orientation", [&] { is_->sample.orientation[2] = kNan; }},
      {"orientation", [&] { is_->sample.orientation[0] = 1.01; }},
      {"velocity", [&] { is_->sample.velocity_m_s[2] = 1000; }},
      {"velocity", [&] { is_->sample.angular_velocity_rad_s[0] = kInf; }},
      {"deflection", [&] { is_->sample.push[0] = 1.5; }},
      {"deflection", [&] { is_->sample.turn[0] = kNan; }},
      {"future", [&] { is_->sample.time_ns = now_ns() + 1'000'000'000; }},
      {"future", [&] { is_->sample.seen_ns = -1; }},
      {"back", [&] { is_->sample.time_ns = 1; }},
      {"fewer", [&] { is_->sample.reports = 1; }},
      {"stage", [&] { is_->stage = 77; }},
      {"stage", [&] { is_->stage = -1; }},
      {"stage", [&] { is_->stage = int(Stage::kEnabled); }}};
  for (const auto& [what, lie] : lies) {
    SCOPED_TRACE(what);
    const auto driver = open();
    is_->sample.time_ns = is_->sample.seen_ns = now_ns(), is_->sample.reports = 10;
    is_->sample.position_m[0] = 0.01;
    step(*driver);
    step(*driver, pushing({1, 0, 0}));
    ASSERT_FALSE(feels_nothing());
    const auto honest = is_->sample;
    lie();
    EXPECT_EQ(step(*driver, pushing({1, 0, 0})), Stage::kFault);  // force of the step before its lie was known
    EXPECT_EQ(newest_.X_BD.p, glm::dvec3(0.01, 0, 0));            // the last that was true
    is_->sample = honest, is_->stage = FARFEEL_DEVICE_READY;
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(step(*driver, i == 1 ? Command{} : pushing({1, 0, 0})), Stage::kFault);
      EXPECT_TRUE(feels_nothing());
      EXPECT_TRUE(spatial::is_valid(newest_.X_BD));
    }
    expect_says(driver->advice(), what);
    is_->stage = FARFEEL_DEVICE_ABSENT;
    EXPECT_EQ(step(*driver), Stage::kAbsent);
    is_->stage = FARFEEL_DEVICE_READY;
  }
}

TEST_F(PlugInDriver, estimates_the_velocity_that_a_device_does_not_tell) {
  is_->sample.has_velocity = 0;
  is_->sample.velocity_m_s[0] = 99;  // not to be looked at
  const auto driver = open();
  const std::int64_t begin_ns = now_ns() - 1'000'000'000;
  for (int i = 0; i <= 100; ++i) {  // 0.2 m/s along x, 3 rad/s about y
    is_->sample.time_ns = is_->sample.seen_ns = begin_ns + i * 1'000'000;
    is_->sample.reports = i + 1;
    is_->sample.position_m[0] = 0.2 * 1e-3 * i;
    is_->sample.orientation[0] = std::cos(1.5e-3 * i), is_->sample.orientation[2] = std::sin(1.5e-3 * i);
    step(*driver);
  }
  EXPECT_NEAR(newest_.V_BD_B.linear_m_s.x, 0.2, 1e-6);
  EXPECT_NEAR(newest_.V_BD_B.angular_rad_s.y, 3, 1e-5);
  is_->sample.time_ns += 500'000'000, is_->sample.seen_ns = is_->sample.time_ns, ++is_->sample.reports;
  is_->sample.position_m[0] = 0.09;
  step(*driver);
  EXPECT_EQ(newest_.V_BD_B.linear_m_s, glm::dvec3(0));  // after a gap nothing is known
}

TEST_F(PlugInDriver, tells_how_force_is_taken_off) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  is_->zero_force_result = FARFEEL_DEVICE_OK;
  is_->zero_force.fd = ends[1], is_->zero_force.size = 3;
  std::memcpy(is_->zero_force.bytes, "off", 3);
  const auto zero = open()->zero_force();
  ASSERT_TRUE(zero);
  EXPECT_EQ(zero->fd, ends[1]);
  EXPECT_EQ(zero->how, ZeroForce::How::kWrite);
  EXPECT_EQ(zero->size, 3U);
  EXPECT_EQ(std::memcmp(zero->bytes.data(), "off", 3), 0);
  is_->zero_force.is_usb_bulk = 1, is_->zero_force.endpoint = 2;
  EXPECT_EQ(open()->zero_force()->endpoint, 2);
  is_->zero_force.endpoint = 0x82;
  expect_says(trouble_in_opening(), "endpoint");
  is_->zero_force.endpoint = 2, is_->zero_force.size = 129;
  expect_says(trouble_in_opening(), "size");
  is_->zero_force.size = 3;
  close(ends[0]), close(ends[1]);
  expect_says(trouble_in_opening(), "descriptor");
}

TEST_F(PlugInDriver, refuses_libraries_with_the_reason) {
  const auto trouble = [](const std::string& path) {
    const auto found = find_plug_in_devices({.firmware = {}, .plug_in = path});
    EXPECT_EQ(found.size(), 1U);
    EXPECT_FALSE(open_plug_in_device(found.at(0), {}));
    return found.at(0).trouble;
  };
  expect_says(trouble(kFolder + "/none.so"), "no such file");
  expect_says(trouble(kFolder + "/no_plug_in.so"), "no plug-in of Farfeel");
  expect_says(trouble(kFolder + "/newer_plug_in.so"), "version 2");
  const test_support::PrivateFolder own;
  const std::string text = own / "text.so";
  std::ofstream(text) << "not a library\n";
  chmod(text.c_str(), 0644);
  expect_says(trouble(text), "no shared library");
  chmod(text.c_str(), 0666);
  expect_says(trouble(text), "chmod go-w");
  is_->has_no_table = 1;
  expect_says(trouble(kObedient), "returned nothing");
}

TEST_F(PlugInDriver, refuses_tables_with_the_reason) {
  const auto whole = [&] {
    find();
    return is_->table;
  }();
  const std::pair<const char*, std::function<void()>> lacks[] = {
      {"bytes", [&] { is_->table.struct_size = 16; }},        {"version 2", [&] { is_->table.abi = 2; }},
      {"name", [&] { is_->table.name = nullptr; }},           {"name", [&] { is_->table.name = ""; }},
      {"find()", [&] { is_->table.find = nullptr; }},         {"open()", [&] { is_->table.open = nullptr; }},
      {"describe()", [&] { is_->table.describe = nullptr; }}, {"step()", [&] { is_->table.step = nullptr; }},
      {"advice()", [&] { is_->table.advice = nullptr; }},     {"close()", [&] { is_->table.close = nullptr; }}};
  for (const auto& [what, break_it] : lacks) {
    is_->table = whole;
    break_it();
    expect_says(find().at(0).trouble, what);
  }
  const std::string longest(100, 'n');
  is_->table = whole, is_->table.name = longest.c_str();
  expect_says(find().at(0).trouble, "name");
  is_->table = whole, is_->table.zero_force = nullptr;
  EXPECT_FALSE(open()->zero_force());
}

TEST_F(PlugInDriver, refuses_what_find_cannot_mean) {
  const auto trouble = [&](auto& array, const std::string& text) {
    const auto before = is_->found;
    std::memset(array, 0, sizeof array);
    std::memcpy(array, text.data(), std::min(text.size(), sizeof array));
    const auto found = find();
    is_->found = before;
    return found.at(0).trouble;
  };
  expect_says(trouble(is_->found.model, std::string(64, 'm')), "ending zero");
  expect_says(trouble(is_->found.trouble, std::string(256, 't')), "ending zero");
  expect_says(trouble(is_->found.model, ""), "model");
  expect_says(trouble(is_->found.model, "../falcon"), "model");
  expect_says(trouble(is_->found.id, ""), "id");
  expect_says(trouble(is_->found.id, "a#b"), "id");
  expect_says(trouble(is_->found.serial, "a\x1b[2J"), "control");
  EXPECT_EQ(trouble(is_->found.trouble, "no permission"), "no permission");
  is_->find_result = 99;
  expect_says(find().at(0).trouble, "find() failed");
  is_->find_result = 0, is_->devices = 0;
  EXPECT_TRUE(find().empty());
  is_->devices = 1000;
  EXPECT_EQ(find().size(), 16U);  // a plug-in that never ends
}

TEST_F(PlugInDriver, refuses_what_open_and_describe_cannot_mean) {
  is_->open_result = FARFEEL_DEVICE_FAILED;
  expect_says(trouble_in_opening(), "did not say why");
  is_->has_endless_error = 1;
  EXPECT_LT(trouble_in_opening().size(), 1000U);
  is_->open_result = FARFEEL_DEVICE_OK, is_->gives_no_device = 1;
  expect_says(trouble_in_opening(), "no device");
  is_->gives_no_device = 0;
  is_->describe_result = FARFEEL_DEVICE_FAILED;
  expect_says(trouble_in_opening(), "describe() failed");
  is_->describe_result = FARFEEL_DEVICE_OK;

  auto& says = is_->description;
  const auto honest = says;
  const std::pair<const char*, std::function<void()>> lies[] = {
      {"max_force_N", [&] { says.max_force_N = kInf; }},
      {"max_force_N", [&] { says.force_dof = 0; }},
      {"continuous_force_N", [&] { says.continuous_force_N = 6; }},
      {"max_torque_Nm", [&] { says.max_torque_Nm = -1; }},
      {"force_dof", [&] { says.force_dof = 4; }},
      {"tells", [&] { says.tells = 2; }},
      {"rate_Hz", [&] { says.rate_Hz = 0; }},
      {"sensor_delay_s", [&] { says.sensor_delay_s = kNan; }},
      {"holds_force_s", [&] { says.holds_force_s = -1; }},
      {"position_step_m", [&] { says.position_step_m = 0; }},
      {"mass_kg", [&] { says.mass_kg = -0.1; }},
      {"enable_button", [&] { says.enable_button = 32; }},
      {"workspace", [&] { says.workspace_min_B_m[1] = 0.1; }},
      {"workspace", [&] { says.workspace_max_B_m[1] = kNan; }},
      {"ending zero", [&] { std::memset(says.title, 'x', sizeof says.title); }},
      {"ending zero", [&] { std::memset(says.estimated, ',', sizeof says.estimated); }},
      {"control", [&] { says.title[0] = '\n'; }}};
  for (const auto& [what, lie] : lies) {
    says = honest;
    lie();
    expect_says(trouble_in_opening(), what);
  }
}

TEST_F(PlugInDriver, advice_ends_where_its_room_does) {
  const auto driver = open();
  is_->stage = FARFEEL_DEVICE_HOMING;
  step(*driver);
  std::strcpy(is_->advice, "Turn it\nonce.");
  EXPECT_EQ(driver->advice(), "Turn it once.");
  std::memset(is_->advice, 'a', sizeof is_->advice);
  EXPECT_EQ(driver->advice().size(), 512U);
}

TEST_F(PlugInDriver, finds_what_a_person_installed) {
  const test_support::PrivateFolder private_home;
  const std::string& home = private_home.path();
  const std::string folder = home + "/farfeel/plug-ins";
  std::filesystem::create_directories(folder);
  std::filesystem::permissions(folder, std::filesystem::perms::owner_all);
  const char* const before = std::getenv("XDG_CONFIG_HOME");
  const std::string kept = before != nullptr ? before : "";
  setenv("XDG_CONFIG_HOME", home.c_str(), 1);
  std::filesystem::copy_file(std::string(FARFEEL_PLUG_INS) + "/simulated_handle.so", folder + "/b.so");
  std::filesystem::copy_file(kFolder + "/no_plug_in.so", folder + "/a.so");
  std::ofstream(folder + "/readme.txt") << "no library";
  chmod((folder + "/a.so").c_str(), 0644), chmod((folder + "/b.so").c_str(), 0644);
  const auto found = find_plug_in_devices({});
  ASSERT_EQ(found.size(), 2U);
  expect_says(found[0].trouble, "a.so");
  EXPECT_EQ(found[1].model, "simulated-handle");
  EXPECT_TRUE(open_plug_in_device(found[1], {}));

  chmod(folder.c_str(), 0777);
  for (const auto& device : find_plug_in_devices({})) expect_says(device.trouble, "chmod go-w");
  std::filesystem::remove_all(home);
  EXPECT_TRUE(find_plug_in_devices({}).empty());
  if (before != nullptr) {
    setenv("XDG_CONFIG_HOME", kept.c_str(), 1);
  } else {
    unsetenv("XDG_CONFIG_HOME");
  }
}

}  // namespace
}  // namespace farfeel::devices
