// Objects that come and go under a hand that presses: what is not there is not felt, whatever older answers still say,
// and the force makes no step on the way.
#include <algorithm>

#include "tests/unit/master_station/haptic_loop/rig.h"

namespace farfeel::master_station {
namespace {

constexpr double kComesOrGoes_s = 2, kRoundTrip_s = 0.05;
constexpr double kMostStep_N = 0.2;  // of a tick: as after a silence

/// Four corners of a tool on an object that may change, 50 ms away.
struct Living {
  explicit Living(bool is_there, local_model::ContactLaw contact)
      : device(Rig::device_settings(kMediumGrip)), loop(device, remote, settings(is_there, contact)) {
    remote.set_link({.round_trip_ns = static_cast<std::int64_t>(1e9 * kRoundTrip_s)});
    remote.world.points_T = {{3e-3, 2e-3, 0}, {3e-3, -2e-3, 0}, {-3e-3, 2e-3, 0}, {-3e-3, -2e-3, 0}};
    remote.world.material.stiffness_N_per_m = 500;
    remote.on_answer = [this, is_there](contact::ContactSet& set) {
      const bool is_there_then = is_there == (1e-9 * static_cast<double>(set.pose_time_ns) < kComesOrGoes_s);
      if (!is_there_then && !tells_all) set.count = 0;
    };
  }
  static HapticLoopSettings settings(bool is_there, local_model::ContactLaw contact) {
    HapticLoopSettings settings =
        Rig::loop_settings(local_model::Rung::kLinear, {}, tool::Integrator::kBackwardEuler, contact);
    settings.moving = {{.object = 0, .before = motion::at_rest({}, is_there)}};
    return settings;
  }
  TickRecord tick() {
    device.hold_at({{1, 0, 0, 0}, {0, 0.1e-3, -2.0 / kMediumGrip.stiffness_N_per_m}});
    loop.tick({time_ns, 0, 0, 0});
    time_ns += kTick_ns;
    TickRecord record;
    EXPECT_TRUE(loop.records().pop(record));
    return record;
  }
  void tell(bool is_there) {
    motion::Course course = motion::at_rest({}, is_there);
    course.version = 1, course.from_s = kComesOrGoes_s;
    remote.courses.push_back({0, course});
  }

  bool tells_all = false;  // a remote that goes on about what is not there
  SimulatedDevice device;
  test_support::AnalyticRemote remote;
  HapticLoop loop;
  std::int64_t time_ns = 5'000'000'000;
};

class Courses : public testing::TestWithParam<std::pair<local_model::ContactLaw, bool>> {};

/// With a remote that is right, and with one whose answers never stop to tell of the object.
TEST_P(Courses, WhatGoesIsLetGoAndNoAnswerBringsItBack) {
  const auto [contact, tells_all] = GetParam();
  Living living(true, contact);
  living.tells_all = tells_all;
  double before_N = 0, largest_step_N = 0, least_port_J = 0;
  glm::dvec3 last_N{0};
  for (int tick = 0; tick < 3000; ++tick) {
    if (tick == 1900) living.tell(false);
    const TickRecord record = living.tick();
    const double scene_s = 1e-3 * tick;
    if (tick == 1999) before_N = glm::length(record.F_hand_W.force_N);
    if (tick > 1000) largest_step_N = std::max(largest_step_N, glm::distance(record.F_hand_W.force_N, last_N));
    if (scene_s > kComesOrGoes_s + 0.1) {
      EXPECT_EQ(record.contacts, 0u) << tick;
      EXPECT_EQ(glm::length(record.F_contact_To_W.force_N), 0) << tick;
    }
    least_port_J = std::min(least_port_J, record.contact_port_J);
    last_N = record.F_hand_W.force_N;
  }
  EXPECT_GT(before_N, 0.7);
  EXPECT_LT(largest_step_N, kMostStep_N);
  if (contact == local_model::ContactLaw::kPenalty) {
    EXPECT_GT(least_port_J, -1e-6);
  }
  EXPECT_EQ(living.loop.fault(), Fault::kNone) << message(living.loop.fault());
}

TEST_P(Courses, WhatComesIsFeltFromItsTimeOnAndNotBefore) {
  const auto [contact, tells_all] = GetParam();
  Living living(false, contact);
  living.tells_all = tells_all;
  double after_N = 0, largest_step_N = 0;
  glm::dvec3 last_N{0};
  for (int tick = 0; tick < 4000; ++tick) {
    if (tick == 1900) living.tell(true);
    const TickRecord record = living.tick();
    if (1e-3 * tick < kComesOrGoes_s) {
      EXPECT_EQ(record.contacts, 0u) << tick;
      EXPECT_EQ(glm::length(record.F_contact_To_W.force_N), 0) << tick;
    }
    if (tick > 1000) largest_step_N = std::max(largest_step_N, glm::distance(record.F_hand_W.force_N, last_N));
    after_N = glm::length(record.F_hand_W.force_N);
    last_N = record.F_hand_W.force_N;
  }
  EXPECT_GT(after_N, 0.7);
  EXPECT_LT(largest_step_N, kMostStep_N);
  EXPECT_EQ(living.loop.fault(), Fault::kNone) << message(living.loop.fault());
}

/// A course that the link held back for a second, under a hand that presses on the object: it rises by 2 mm.
TEST_P(Courses, ToldTooLateMakeNoStep) {
  const auto [contact, tells_all] = GetParam();
  Living living(true, contact);
  living.tells_all = true;
  double largest_step_N = 0;
  glm::dvec3 last_N{0};
  for (int tick = 0; tick < 5000; ++tick) {
    if (tick == 3000) {
      living.remote.courses.push_back({0, {.version = 1, .from_s = kComesOrGoes_s, .takes_s = 0.1}});
      living.remote.courses.back().course.X_to_WO.p = {0, 0, 2e-3};
    }
    const TickRecord record = living.tick();
    if (tick > 1000) largest_step_N = std::max(largest_step_N, glm::distance(record.F_hand_W.force_N, last_N));
    last_N = record.F_hand_W.force_N;
  }
  EXPECT_LT(largest_step_N, kMostStep_N);
  EXPECT_EQ(living.loop.fault(), Fault::kNone) << message(living.loop.fault());
}

INSTANTIATE_TEST_SUITE_P(Laws, Courses,
                         testing::Values(std::pair(local_model::ContactLaw::kPenalty, false),
                                         std::pair(local_model::ContactLaw::kPenalty, true),
                                         std::pair(local_model::ContactLaw::kConstraint, false),
                                         std::pair(local_model::ContactLaw::kConstraint, true)));

}  // namespace
}  // namespace farfeel::master_station
