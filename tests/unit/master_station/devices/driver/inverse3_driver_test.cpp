// The driver against the imitated service, over a real WebSocket.
#include "master_station/devices/driver/inverse3_driver.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "haptic_core/realtime/periodic_loop.h"
#include "tests/support/devices/inverse_service.h"
#include "tests/support/realtime_guard.h"

namespace farfeel::devices {
namespace {

using Fault = InverseService::Fault;

constexpr std::int64_t kPatience_ns = 400'000'000;  // the imitated service's thread may have to wait for a busy machine

class Inverse3 : public ::testing::Test {
 protected:
  void SetUp() override { setenv("FARFEEL_INVERSE3", service_.uri().c_str(), 1); }
  void TearDown() override {
    driver_.reset();
    unsetenv("FARFEEL_INVERSE3");
  }

  void open() {
    driver_.reset();
    const auto found = kInverse3Family.find({});
    ASSERT_EQ(found.size(), 1U);
    ASSERT_EQ(found[0].trouble, "");
    auto channel = open_websocket(*loopback_address(found[0].path));
    ASSERT_TRUE(channel) << channel.error();
    auto driver = Inverse3Driver::open(std::move(*channel), found[0], kPatience_ns);
    ASSERT_TRUE(driver) << driver.error().message;
    driver_ = std::move(*driver);
    ASSERT_EQ(step({}, false), Stage::kReady) << driver_->advice();
  }
  Stage step(const glm::dvec3& force_N, bool is_force_on = true) {
    const Command command{.time_ns = realtime::monotonic_now_ns(),
                          .F_hand_B = {.torque_Nm = {1, 1, 1}, .force_N = force_N},
                          .opening = 1,
                          .is_force_on = is_force_on,
                          .is_light_on = false};
    return driver_->step(realtime::monotonic_now_ns() + 2'000'000, command, newest_);
  }
  /// Steps so long by the clock, or until the stage is another; the last stage.
  Stage hold(const glm::dvec3& force_N, double time_s, bool is_force_on = true, Stage stage = Stage::kReady) {
    const auto end_ns = realtime::monotonic_now_ns() + static_cast<std::int64_t>(1e9 * time_s);
    Stage now = stage;
    while (realtime::monotonic_now_ns() < end_ns && now == stage) now = step(force_N, is_force_on);
    return now;
  }
  /// Until the service was told a force that is zero in all axes; false: it never was.
  bool is_told_zero() {
    const auto end_ns = realtime::monotonic_now_ns() + 2'000'000'000;
    while (realtime::monotonic_now_ns() < end_ns) {
      const auto force_N = service_.force_N();
      if (force_N[0] == 0 && force_N[1] == 0 && force_N[2] == 0) return true;
      usleep(200);
    }
    return false;
  }

  InverseService service_;
  std::unique_ptr<Driver> driver_;
  Sample newest_;
};

TEST_F(Inverse3, is_found_with_its_id) {
  const auto found = kInverse3Family.find({});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].model, "inverse3");
  EXPECT_EQ(found[0].serial, "049D");
  EXPECT_EQ(found[0].path, service_.uri());
}

TEST_F(Inverse3, is_not_found_without_a_service) {
  setenv("FARFEEL_INVERSE3", "ws://localhost:1", 1);
  EXPECT_TRUE(kInverse3Family.find({}).empty());
  setenv("FARFEEL_INVERSE3", "ws://192.0.2.1:10001", 1);
  ASSERT_EQ(kInverse3Family.find({}).size(), 1U);
  EXPECT_NE(kInverse3Family.find({})[0].trouble.find("this machine"), std::string::npos);
  service_.refuse_connections(true);
  setenv("FARFEEL_INVERSE3", service_.uri().c_str(), 1);
  EXPECT_TRUE(kInverse3Family.find({}).empty());
  service_.refuse_connections(false);
  service_.set(Fault::kSilence);
  ASSERT_EQ(kInverse3Family.find({}).size(), 1U);
  EXPECT_NE(kInverse3Family.find({})[0].trouble, "");
}

TEST_F(Inverse3, force_reaches_the_reading) {
  open();
  const glm::dvec3 force_N{1, -2, 0.5};
  ASSERT_EQ(hold(force_N, 0.7), Stage::kReady) << driver_->advice();
  EXPECT_LT(glm::length(newest_.X_BD.p - force_N / InverseService::kStiffness_N_per_m), 1e-5);
  EXPECT_LT(glm::length(newest_.V_BD_B.linear_m_s), 1e-3);
  EXPECT_LT(std::abs(glm::length(newest_.X_BD.R) - 1), 1e-12);
  EXPECT_EQ(newest_.X_BD.R, glm::dquat(0.5, 0.5, 0.5, 0.5));  // the grip's
  EXPECT_GT(newest_.reports, 50U);
  ASSERT_EQ(hold({}, 0.7, false), Stage::kReady);
  EXPECT_LT(glm::length(newest_.X_BD.p), 1e-5);
  EXPECT_EQ(service_.unreadable(), 0U);
}

TEST_F(Inverse3, one_message_is_out_at_a_time) {
  open();
  const std::uint64_t reports = newest_.reports, messages = service_.messages();
  hold({1, 0, 0}, 0.2);
  EXPECT_LE(service_.messages() - messages, newest_.reports - reports + 1);
}

TEST_F(Inverse3, the_grip_tells_buttons_and_what_the_device_measures) {
  open();
  service_.press(5);
  hold({}, 0.02, false);
  EXPECT_EQ(newest_.buttons, 5U);
  EXPECT_NE(driver_->model_toml().find("rotation_dof = 3"), std::string::npos);
  service_.set_grip(false);
  EXPECT_EQ(hold({}, 0.05, false), Stage::kReady);
  EXPECT_EQ(newest_.buttons, 0U);  // at once: what a button holds on ends
  EXPECT_EQ(hold({1, 0, 0}, 2), Stage::kFault);
  EXPECT_NE(driver_->advice().find("VerseGrip"), std::string::npos);
  EXPECT_TRUE(is_told_zero());
  open();  // without one
  EXPECT_EQ(driver_->model_toml(), "");
  EXPECT_EQ(newest_.X_BD.R, glm::dquat(1, 0, 0, 0));
}

TEST_F(Inverse3, force_is_capped_and_finite) {
  open();
  hold({300, 0, -400}, 0.02);
  auto force_N = service_.force_N();
  EXPECT_NEAR(force_N[0], 6, 1e-5);
  EXPECT_NEAR(force_N[2], -8, 1e-5);
  hold(glm::dvec3(1e308), 0.02);
  force_N = service_.force_N();
  EXPECT_NEAR(std::hypot(force_N[0], force_N[1], force_N[2]), 10, 1e-4);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    hold({1, bad, 0}, 0.02);
    EXPECT_TRUE(is_told_zero());
    EXPECT_EQ(newest_.stage, Stage::kReady);
  }
  EXPECT_EQ(service_.unreadable(), 0U);
}

TEST_F(Inverse3, no_fault_leaves_force_on) {
  const std::pair<Fault, Stage> faults[] = {{Fault::kSilence, Stage::kFault}, {Fault::kTornText, Stage::kFault},
                                            {Fault::kFar, Stage::kFault},     {Fault::kNotCalibrated, Stage::kHoming},
                                            {Fault::kNull, Stage::kFault},    {Fault::kNoPower, Stage::kFault}};
  for (const auto& [fault, stage] : faults) {
    SCOPED_TRACE(int(fault));
    service_.set(Fault::kNone);
    open();
    ASSERT_EQ(hold({1, 0, 0}, 0.05), Stage::kReady);
    EXPECT_EQ(service_.force_N()[0], 1);
    service_.set(fault);
    EXPECT_EQ(hold({1, 0, 0}, 2), stage);
    EXPECT_NE(driver_->advice(), "");
    EXPECT_TRUE(is_told_zero());
    (void)service_.greatest_force_N();  // from here on
    for (int i = 0; i < 20; ++i) {
      EXPECT_EQ(step({1, 0, 0}), stage);
      EXPECT_TRUE(spatial::is_valid(newest_.X_BD));
    }
    service_.set(Fault::kNone);
    const auto end_ns = realtime::monotonic_now_ns() + 2'000'000'000;
    while (fault != Fault::kSilence && step({1, 0, 0}) != Stage::kReady && realtime::monotonic_now_ns() < end_ns) {
    }
    hold({1, 0, 0}, 0.05);  // it is well again, but nobody let go of the force yet
    EXPECT_EQ(service_.greatest_force_N(), 0);
    hold({}, 0.05, false, newest_.stage);
    if (fault == Fault::kSilence) continue;  // the answer that never came is waited for: see the next test
    hold({1, 0, 0}, 0.05);
    EXPECT_EQ(newest_.stage, Stage::kReady);
    EXPECT_EQ(service_.force_N()[0], 1);
  }
}

TEST_F(Inverse3, after_silence_it_speaks_again_or_is_gone) {
  open();
  hold({1, 0, 0}, 0.05);
  service_.set(Fault::kSilence);
  ASSERT_EQ(hold({1, 0, 0}, 2), Stage::kFault);
  service_.set(Fault::kNone);
  EXPECT_EQ(hold({}, 2, false, Stage::kFault), Stage::kReady);
  service_.set(Fault::kSilence);
  ASSERT_EQ(hold({}, 2, false), Stage::kFault);
  EXPECT_EQ(hold({}, 10, false, Stage::kFault), Stage::kAbsent);
}

TEST_F(Inverse3, a_service_that_goes_is_absent) {
  for (const Fault fault : {Fault::kHangUp, Fault::kNoArm, Fault::kHuge, Fault::kOtherText}) {
    SCOPED_TRACE(int(fault));
    service_.set(Fault::kNone);
    open();
    hold({1, 0, 0}, 0.05);
    service_.set(fault);
    EXPECT_EQ(hold({1, 0, 0}, 2), Stage::kAbsent);
    EXPECT_NE(driver_->advice(), "");
  }
}

TEST_F(Inverse3, parts_pings_and_old_news_are_no_fault) {
  for (const Fault fault : {Fault::kFragments, Fault::kPings, Fault::kOld}) {
    SCOPED_TRACE(int(fault));
    service_.set(Fault::kNone);
    open();
    service_.set(fault);
    EXPECT_EQ(hold({0.5, 0, 0}, 0.3), Stage::kReady) << driver_->advice();
    EXPECT_TRUE(spatial::is_valid(newest_.X_BD) && spatial::is_finite(newest_.V_BD_B));
  }
}

TEST_F(Inverse3, other_axes_are_refused) {
  service_.set_basis("XZY");
  const auto driver = kInverse3Family.open(kInverse3Family.find({}).at(0), {});
  ASSERT_TRUE(driver);
  Sample sample;
  // The list told it, and no update does: what was told holds.
  for (int i = 0; i < 20; ++i)
    EXPECT_EQ((*driver)->step(realtime::monotonic_now_ns() + 2'000'000, {}, sample), Stage::kFault);
  EXPECT_NE((*driver)->advice().find("XYZ"), std::string::npos);
}

TEST_F(Inverse3, the_keepers_bytes_take_force_off) {
  open();
  ASSERT_EQ(hold({1, 0, 0}, 0.05), Stage::kReady);
  const auto zero = driver_->zero_force();
  ASSERT_TRUE(zero);
  EXPECT_EQ(zero->how, ZeroForce::How::kWrite);
  ASSERT_EQ(service_.force_N()[0], 1);
  const int kept = dup(zero->fd);
  ASSERT_EQ(write(kept, zero->bytes.data(), zero->size), static_cast<ssize_t>(zero->size));
  EXPECT_TRUE(is_told_zero());
  EXPECT_EQ(service_.unreadable(), 0U);
  close(kept);
}

TEST_F(Inverse3, ends_without_force) {
  open();
  hold({1, 0, 0}, 0.05);
  driver_.reset();
  EXPECT_TRUE(is_told_zero());
}

TEST_F(Inverse3, a_step_allocates_nothing) {
  if (!test_support::RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need these functions themselves";
  open();
  hold({1, 0, 0}, 0.1);
  const std::uint64_t before = test_support::RealtimeGuard::violations();
  {
    const test_support::RealtimeGuard guard;
    hold({1, 0, 0}, 0.2);
  }
  EXPECT_EQ(test_support::RealtimeGuard::violations() - before, 0U) << test_support::RealtimeGuard::first_violation();
}

}  // namespace
}  // namespace farfeel::devices
