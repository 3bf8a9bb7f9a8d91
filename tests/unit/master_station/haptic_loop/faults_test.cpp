// What goes wrong must not be felt as a blow: whatever the remote, the link or the device does, the force on the hand
// changes by less than kJump_N from one tick to the next.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "tests/unit/master_station/haptic_loop/rig.h"

namespace farfeel::master_station {
namespace {

constexpr double kJump_N = 0.2, kJump_Nm = 0.02;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A device that says what the test tells it.
class ScriptedDevice final : public Device {
 public:
  explicit ScriptedDevice(Device& real) : real_(real) {}
  const DeviceCapabilities& capabilities() const noexcept override { return real_.capabilities(); }
  DeviceState read(std::int64_t time_ns) noexcept override {
    DeviceState state = real_.read(time_ns);
    if (spoil) spoil(state);
    return state;
  }
  void write(const spatial::Wrench& F) noexcept override { real_.write(F); }
  std::function<void(DeviceState&)> spoil;

 private:
  Device& real_;
};

class FaultsTest : public ::testing::Test {
 protected:
  FaultsTest() {
    rig.hold(3);
    for (int i = 0; i < 1500; ++i) rig.tick();
    last = rig.tick();
    EXPECT_EQ(last.state, LoopState::kTouching);
    EXPECT_GT(last.F_hand_W.force_N.z, 1);
  }
  /// Runs on and checks that nothing jumps; returns the last record.
  TickRecord run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const TickRecord record = rig.tick();
      EXPECT_TRUE(spatial::is_finite(record.F_hand_W));
      EXPECT_LE(glm::length(record.F_hand_W.force_N - last.F_hand_W.force_N), kJump_N) << "tick " << i;
      EXPECT_LE(glm::length(record.F_hand_W.torque_Nm - last.F_hand_W.torque_Nm), kJump_Nm) << "tick " << i;
      last = record;
    }
    return last;
  }
  void spoil_answers(std::function<void(contact::ContactSet&)> spoil) { rig.remote.on_answer = std::move(spoil); }

  Rig rig{kMediumGrip};
  TickRecord last;
};

TEST_F(FaultsTest, ContactsThatAreNotFiniteLatchAFaultAndTheForceGoesToZero) {
  spoil_answers([](contact::ContactSet& set) { set.contacts[1].depth_m = kNaN; });
  run(10);
  EXPECT_EQ(rig.loop.fault(), Fault::kContactsNotUsable);
  spoil_answers(nullptr);
  EXPECT_EQ(run(300).state, LoopState::kFault);  // latched, though the answers are good again
  EXPECT_EQ(glm::length(last.F_hand_W.force_N), 0);
  EXPECT_EQ(rig.loop.faults(), 1u);
  rig.loop.reset_fault();
  EXPECT_EQ(run(1500).state, LoopState::kTouching);
}

TEST_F(FaultsTest, AContactThatIsLostWhileDeepIsAFaultAndItsForceFades) {
  const auto soften = [](contact::ContactSet& set) {
    for (std::uint32_t i = 0; i < set.count; ++i) set.contacts[i].material.stiffness_N_per_m = 250;
  };
  spoil_answers(soften);
  run(1500);
  ASSERT_GT(last.depth_max_m, 1e-3);
  const double pressed_N = last.F_hand_W.force_N.z;
  spoil_answers([&](contact::ContactSet& set) { soften(set), set.count = 0; });
  run(4);
  EXPECT_EQ(rig.loop.fault(), Fault::kContactLost);
  EXPECT_GT(last.F_hand_W.force_N.z, 0.5 * pressed_N) << "not let go of at once";
  EXPECT_EQ(run(300).state, LoopState::kFault);
  EXPECT_EQ(glm::length(last.F_hand_W.force_N), 0);
}

TEST_F(FaultsTest, AContactThatIsLostWhileShallowOrHasGoneOutIsNone) {
  spoil_answers([](contact::ContactSet& set) { set.count = 0; });
  run(300);
  EXPECT_EQ(rig.loop.fault(), Fault::kNone) << "0.4 mm deep";
}

TEST_F(FaultsTest, AResetGivesNothingToAHandThatHasSunkIn) {
  for (const bool is_unplugged : {false, true}) {
    Rig inner{kMediumGrip};
    ScriptedDevice device(inner.device);
    HapticLoop loop(device, inner.remote, Rig::loop_settings());
    inner.hold(3);
    TickRecord record, before;
    int ticks = 0;
    double hand_J = 0, least_J = 1e9, largest_step_N = 0;
    const auto run = [&](int count) {
      for (int i = 0; i < count; ++i) {
        loop.tick({++ticks * kTick_ns, 0, 0, 0});
        ASSERT_TRUE(loop.records().pop(record));
        largest_step_N = std::max(largest_step_N, glm::length(record.F_hand_W.force_N - before.F_hand_W.force_N));
        hand_J = inner.device.hand_port().energy_J();
        least_J = std::min(least_J, hand_J);
        before = record;
      }
    };
    run(1000);
    EXPECT_GT(record.F_hand_W.force_N.z, 1);
    largest_step_N = 0;
    if (is_unplugged) device.spoil = [](DeviceState& state) { state.is_live = false; };
    if (!is_unplugged) inner.remote.on_answer = [](contact::ContactSet& set) { set.contacts[1].depth_m = kNaN; };
    run(500);
    EXPECT_EQ(glm::length(record.F_hand_W.force_N), 0);
    device.spoil = nullptr;
    inner.remote.on_answer = nullptr;
    run(100);
    const double sunk_J = hand_J;
    least_J = hand_J;
    loop.reset_fault();
    run(1500);
    EXPECT_EQ(loop.fault(), Fault::kNone);
    EXPECT_LE(largest_step_N, kJump_N);
    EXPECT_GE(least_J, sunk_J - 1e-5);
    EXPECT_GE(loop.local_model().contact_port().least_J(), -1e-6);
    inner.hold(9);
    run(1000);
    EXPECT_GT(record.F_hand_W.force_N.z, 1) << "pressed on, the surface is there";
  }
}

TEST(FaultsOfTheStartTest, ADeviceThatIsPluggedInLateFindsTheToolInItsHand) {
  Rig inner{kMediumGrip};
  ScriptedDevice device(inner.device);
  HapticLoop loop(device, inner.remote, Rig::loop_settings());
  device.spoil = [](DeviceState& state) {
    state = {};
    state.is_live = false;
  };
  int ticks = 0;
  for (; ticks < 100; ++ticks) loop.tick({ticks * kTick_ns, 0, 0, 0});
  EXPECT_EQ(loop.fault(), Fault::kDeviceSilent);
  device.spoil = nullptr;
  loop.reset_fault();
  for (; ticks < 400; ++ticks) loop.tick({ticks * kTick_ns, 0, 0, 0});
  EXPECT_EQ(loop.fault(), Fault::kNone) << message(loop.fault());
  EXPECT_LT(glm::distance(loop.tool().X_WT.p, inner.device.true_pose().p), 2e-3);
}

TEST_F(FaultsTest, UnusableContactsAreRecognisedInEveryField) {
  using Spoil = void (*)(contact::ContactSet&);
  const contact::ContactSet good = rig.remote.world.contacts(last.X_WT);
  ASSERT_TRUE(local_model::is_usable(good));
  for (Spoil spoil :
       {Spoil([](contact::ContactSet& set) { set.count = contact::kMaxContacts + 1; }),
        Spoil([](contact::ContactSet& set) { set.X_WT.R.x = kNaN; }),
        Spoil([](contact::ContactSet& set) { set.F_To_W.force_N.y = kNaN; }),
        Spoil([](contact::ContactSet& set) { set.contacts[0].p_WC_W.z = kNaN; }), Spoil([](contact::ContactSet& set) {
          set.contacts[0].nhat_ST_W = {0, 0, 2};
        }),
        Spoil([](contact::ContactSet& set) { set.contacts[0].depth_m = 1e6; }),
        Spoil([](contact::ContactSet& set) { set.contacts[0].gradient[2] = 1e200; }),
        Spoil([](contact::ContactSet& set) { set.contacts[0].lateral_range_m = -1; }),
        Spoil([](contact::ContactSet& set) { set.contacts[0].material.stiffness_N_per_m = -1; }),
        Spoil([](contact::ContactSet& set) { set.contacts[0].material.dynamic_friction = kNaN; })}) {
    contact::ContactSet bad = good;
    spoil(bad);
    EXPECT_FALSE(local_model::is_usable(bad));
  }
}

TEST_F(FaultsTest, SilenceIsHeldThenFadesAndTheReturnIsGentle) {
  rig.remote.is_silent = true;
  const double pressed_N = last.F_hand_W.force_N.z;
  EXPECT_EQ(run(200).state, LoopState::kHeld);
  EXPECT_NEAR(last.F_hand_W.force_N.z, pressed_N, 0.1 * pressed_N);  // the geometry is still felt
  EXPECT_EQ(run(200).state, LoopState::kFading);
  EXPECT_NEAR(glm::length(last.F_contact_To_W.force_N), 0, 1e-9);
  run(600);
  rig.remote.is_silent = false;
  EXPECT_EQ(run(2000).state, LoopState::kTouching);
  EXPECT_NEAR(last.F_hand_W.force_N.z, pressed_N, 0.1 * pressed_N);
}

TEST(ComparatorsTest, WhatCameOverTheLineIsNotFeltOnceItIsStale) {
  SimulatedDevice device(Rig::device_settings(kMediumGrip));
  test_support::AnalyticRemote remote;
  remote.world.material.stiffness_N_per_m = 100;
  remote.on_answer = [](contact::ContactSet& set) {
    if (set.count > 0 && set.contacts[0].depth_m > 0) set.F_To_W = {{0, 0, 0}, {0, 0, 100 * set.contacts[0].depth_m}};
  };
  HapticLoopSettings settings = Rig::loop_settings();
  settings.controller = teleoperation::Controller::kDirect;
  HapticLoop loop(device, remote, settings);
  spatial::Pose X_WHand = device.explorer().X_WHand();
  X_WHand.p = {0, 0, -0.02};
  device.hold_at(X_WHand);
  std::int64_t time_ns = 5'000'000'000;
  TickRecord last;
  const auto run = [&](int ticks) {
    for (int i = 0; i < ticks; ++i, time_ns += kTick_ns) {
      loop.tick({time_ns, 0, 0, 0});
      ASSERT_TRUE(loop.records().pop(last));
    }
  };
  run(1500);
  EXPECT_GT(last.F_hand_W.force_N.z, 0.2) << "the remote's wrench, straight";
  EXPECT_EQ(last.state, LoopState::kTouching);
  remote.is_silent = true;
  run(120);
  EXPECT_EQ(last.state, LoopState::kHeld);
  EXPECT_NEAR(glm::length(last.F_hand_W.force_N), 0, 1e-9);
  remote.is_silent = false;
  run(1000);
  EXPECT_GT(last.F_hand_W.force_N.z, 0.2);
}

TEST_F(FaultsTest, OneAnswerInASilenceIsNotItsEnd) {
  for (const auto& [silence_ticks, state] : {std::pair(150, LoopState::kHeld), {400, LoopState::kFading}}) {
    run(500);
    ASSERT_EQ(last.state, LoopState::kTouching);
    rig.remote.is_silent = true;
    ASSERT_EQ(run(silence_ticks).state, state);
    rig.remote.is_silent = false;
    run(3);  // answers come every 2 ms
    rig.remote.is_silent = true;
    for (int i = 0; i < 60; ++i) ASSERT_EQ(run(1).state, state) << i;
    rig.remote.is_silent = false;
    EXPECT_EQ(run(100).state, LoopState::kTouching);
  }
}

TEST_F(FaultsTest, AHeldWrenchIsNotHeldForEver) {
  Rig held{kMediumGrip, 0, 500, local_model::Rung::kHeldWrench};
  held.hold(1);
  for (int i = 0; i < 500; ++i) held.tick();
  held.remote.is_silent = true;
  for (int i = 0; i < 260; ++i) held.tick();
  EXPECT_EQ(glm::length(held.tick().F_contact_To_W.force_N), 0);
}

TEST_F(FaultsTest, AWallThatAppearsDeepIsLetInSlowly) {
  rig.remote.world.level_m = 0.002;
  run(3000);
  EXPECT_GT(last.F_hand_W.force_N.z, 2);
  // What it gave is no more than what the tank may give for nothing.
  EXPECT_GE(rig.loop.local_model().contact_port().energy_J(), -rig.loop.local_model().tank().allowed_J());
}

TEST_F(FaultsTest, AnAbsurdDepthIsLetInSlowlyToo) {
  spoil_answers([](contact::ContactSet& set) {
    for (std::size_t i = 0; i < set.count; ++i) set.contacts[i].depth_m = 0.9;
  });
  run(3000);
  EXPECT_NE(last.state, LoopState::kFault);
  EXPECT_LE(glm::length(last.F_hand_W.force_N), 12.0001);
}

TEST_F(FaultsTest, AWallThatVanishesIsLetGoOf) {
  rig.remote.world.level_m = -0.1;
  run(500);
  EXPECT_NEAR(last.F_hand_W.force_N.z, 0, 0.2);
}

TEST_F(FaultsTest, ClustersThatAreRenamedAreNotFelt) {
  std::uint32_t renames = 0;
  const double pressed_N = last.F_hand_W.force_N.z;
  spoil_answers([&](contact::ContactSet& set) {
    renames += 100;
    for (std::size_t i = 0; i < set.count; ++i) set.contacts[i].id.number += renames;
  });
  run(1000);
  EXPECT_NEAR(last.F_hand_W.force_N.z, pressed_N, 0.05 * pressed_N);
}

TEST_F(FaultsTest, AStiffnessThatJumpsIsLetInSlowly) {
  rig.remote.world.material.stiffness_N_per_m *= 5;
  run(1000);
  EXPECT_EQ(last.state, LoopState::kTouching);
}

TEST_F(FaultsTest, ADirectionThatJumpsIsTurnedTo) {
  spoil_answers([](contact::ContactSet& set) {
    const double angle = 25.0 / 180 * 3.14159;
    for (std::size_t i = 0; i < set.count; ++i) {
      contact::Contact& contact = set.contacts[i];
      contact.nhat_ST_W = {std::sin(angle), 0, std::cos(angle)};
      contact.gradient = spatial::to_vector6(
          spatial::Twist{glm::cross(contact.p_WC_W - set.X_WT.p, -contact.nhat_ST_W), -contact.nhat_ST_W});
    }
  });
  run(1000);
}

TEST_F(FaultsTest, OldAnswersAreDroppedAndCounted) {
  contact::ContactSet first = rig.remote.world.contacts(last.X_WT);
  first.pose_sequence = 3;  // long past
  first.contacts[0].depth_m = 0.01;
  int answers = 0;
  spoil_answers([&](contact::ContactSet& set) {
    if (++answers % 2 == 0) set = first;
  });
  run(500);
  EXPECT_GE(rig.loop.sets_out_of_order(), 100u);
  EXPECT_EQ(last.state, LoopState::kTouching);
}

TEST_F(FaultsTest, AnswersToPosesThatWereNeverSentAreDropped) {
  spoil_answers([&](contact::ContactSet& set) { set.pose_sequence += 1'000'000; });
  run(100);
  EXPECT_GE(rig.loop.sets_out_of_order(), 40u);
  EXPECT_EQ(last.state, LoopState::kHeld);
}

// The handle has gone on for six milliseconds when a tick wakes so late; the tool goes as far within that tick, and by
// one millisecond in the next.
TEST(LateTicksTest, AreNotFelt) {
  Rig rig(kMediumGrip);
  glm::dvec3 before_N{0};
  double fastest_m_s = 0;
  for (int i = 0; i < 150; ++i) {
    const bool is_late = i % 10 == 9;
    const spatial::Pose X_WT = rig.loop.tool().X_WT;
    rig.loop.tick({rig.time_ns, is_late ? 5'900'000 : 0, 0, 0});
    rig.time_ns += is_late ? 6 * kTick_ns : kTick_ns;
    TickRecord record;
    ASSERT_TRUE(rig.loop.records().pop(record));
    ASSERT_EQ(record.contacts, 0u);
    if (!is_late) fastest_m_s = std::max(fastest_m_s, glm::length(rig.loop.tool().X_WT.p - X_WT.p) / 1e-3);
    EXPECT_LT(glm::length(record.F_hand_W.force_N - before_N), kJump_N) << i;
    before_N = record.F_hand_W.force_N;
  }
  EXPECT_GT(fastest_m_s, 0.05) << "the hand moves";
}

TEST_F(FaultsTest, ADeviceThatFailsLatchesItsOwnFault) {
  const std::pair<Fault, std::function<void(DeviceState&)>> cases[] = {
      {Fault::kDeviceNotFinite, [](DeviceState& state) { state.X_BD.p.x = kNaN; }},
      {Fault::kDeviceSilent, [](DeviceState& state) { state.is_live = false; }},
      {Fault::kDeviceTooFast, [](DeviceState& state) { state.V_BD_B.linear_m_s.y = 50; }},
      {Fault::kDeviceTooFast, [](DeviceState& state) { state.X_BD.p.x += 0.1; }},
  };
  for (const auto& [fault, spoil] : cases) {
    Rig inner{kMediumGrip};
    ScriptedDevice device(inner.device);
    HapticLoop loop(device, inner.remote, Rig::loop_settings());
    inner.hold(3);
    spatial::Wrench before;
    TickRecord record;
    for (int i = 0; i < 1400; ++i) {
      if (i == 1000) device.spoil = spoil;
      loop.tick({i * kTick_ns, 0, 0, 0});
      ASSERT_TRUE(loop.records().pop(record));
      ASSERT_TRUE(spatial::is_finite(record.F_hand_W));
      if (i >= 1000) {
        EXPECT_LE(glm::length(record.F_hand_W.force_N - before.force_N), kJump_N) << "tick " << i;
      }
      before = record.F_hand_W;
    }
    EXPECT_EQ(loop.fault(), fault) << message(loop.fault());
    EXPECT_EQ(glm::length(record.F_hand_W.force_N), 0);
  }
}

}  // namespace
}  // namespace farfeel::master_station
