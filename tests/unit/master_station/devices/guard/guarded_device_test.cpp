// Each limit of the guard is tripped once, and shown not to trip by itself; what nobody thought of is tried at random.
#include "master_station/devices/guard/guarded_device.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace farfeel::devices {
namespace {

using master_station::DeviceFault;
using master_station::DeviceState;

constexpr std::int64_t kTick_ns = 1'000'000;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Says what the test tells it and keeps what it is told.
class Puppet final : public master_station::Device {
 public:
  const master_station::DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
  DeviceState read(std::int64_t) noexcept override { return state; }
  void write(const spatial::Wrench& F) noexcept override { written = F; }
  DeviceState state;
  spatial::Wrench written;

 private:
  master_station::DeviceCapabilities capabilities_;
};

DeviceModel model_of(Enabling enabling) {
  DeviceModel model = *find_model("simulated");
  model.enabling = enabling;
  model.workspace_min_B_m = glm::dvec3(-0.1);
  model.workspace_max_B_m = glm::dvec3(0.1);
  return model;
}

struct Bench {
  explicit Bench(GuardSettings settings = {model_of(Enabling::kHold)}) : guard(device, settings) {}
  /// Ticks with this wanted force; returns the last step of the force on the device.
  DeviceState run(int ticks, const glm::dvec3& F) {
    DeviceState state;
    for (int i = 0; i < ticks; ++i) {
      now_ns += kTick_ns;
      if (is_streaming) device.state.time_ns = now_ns;
      state = guard.read(now_ns);
      const glm::dvec3 before = device.written.force_N;
      guard.write({{0, 0, 0}, F});
      largest_step_N = std::max(largest_step_N, glm::length(device.written.force_N - before));
    }
    return state;
  }
  void enable() {
    device.state.buttons = 0;
    run(2, {});
    device.state.buttons = 1;
    run(250, {});
    largest_step_N = 0;
  }
  [[nodiscard]] double force_N() const { return glm::length(device.written.force_N); }

  Puppet device;
  GuardedDevice guard;
  std::int64_t now_ns = 1'000'000'000;
  bool is_streaming = true;
  double largest_step_N = 0;
};

TEST(GuardedDeviceTest, ForceComesWithAnEdgeOfTheGripAndNeverWithItsLevel) {
  Bench bench;
  bench.device.state.buttons = 1;  // held from before
  EXPECT_EQ(bench.run(500, {0, 0, 2}).stage, Stage::kReady);
  EXPECT_EQ(bench.force_N(), 0);
  bench.device.state.buttons = 0;
  bench.run(10, {0, 0, 2});
  bench.device.state.buttons = 1;
  EXPECT_EQ(bench.run(1, {0, 0, 2}).stage, Stage::kEnabled);
  EXPECT_LT(bench.force_N(), 0.02);
  bench.run(300, {0, 0, 2});
  EXPECT_NEAR(bench.force_N(), 2, 1e-9);
  EXPECT_LE(bench.largest_step_N, 2 * 1e-3 / GuardedDevice::kRise_s + 1e-9);
  bench.device.state.buttons = 0;
  EXPECT_EQ(bench.run(1, {0, 0, 2}).stage, Stage::kStopping);
  EXPECT_EQ(bench.run(101, {0, 0, 2}).stage, Stage::kReady);
  EXPECT_EQ(bench.force_N(), 0);
}

TEST(GuardedDeviceTest, APressPutsForceOnAndTheNextTakesItOff) {
  Bench bench({model_of(Enabling::kPress)});
  bench.enable();
  bench.device.state.buttons = 0;
  EXPECT_EQ(bench.run(300, {1, 0, 0}).stage, Stage::kEnabled);
  bench.device.state.buttons = 1;
  bench.run(200, {1, 0, 0});
  EXPECT_EQ(bench.force_N(), 0);
}

TEST(GuardedDeviceTest, WithoutAButtonTheStationsKeyIsHeld) {
  Bench bench({model_of(Enabling::kStation)});
  bench.run(10, {1, 0, 0});
  for (const bool is_released : {true, false}) {
    bench.guard.hold_station_key_until(bench.now_ns + 400'000'000);
    bench.run(300, {1, 0, 0});
    EXPECT_NEAR(bench.force_N(), 1, 1e-9);
    if (is_released) bench.guard.hold_station_key_until(0);
    bench.run(is_released ? 101 : 205, {1, 0, 0});  // or nobody tells any more
    EXPECT_EQ(bench.force_N(), 0);
  }
}

TEST(GuardedDeviceTest, AfterAFaultAResetOnlyArms) {
  using Spoil = void (*)(DeviceState&);
  for (const auto& [fault, spoil] :
       {std::pair{DeviceFault::kTooFast, Spoil([](DeviceState& s) { s.V_BD_B.linear_m_s.x = 3; })},
        std::pair{DeviceFault::kTooFast, Spoil([](DeviceState& s) { s.X_BD.p.y += 0.05; })},
        std::pair{DeviceFault::kNotFinite, Spoil([](DeviceState& s) { s.X_BD.p.z = kNaN; })},
        std::pair{DeviceFault::kNotFinite, Spoil([](DeviceState& s) { s.V_BD_B.angular_rad_s.x = kNaN; })}}) {
    Bench bench;
    bench.enable();
    bench.run(500, {0, 0, 2});
    EXPECT_EQ(bench.guard.fault(), DeviceFault::kNone);
    const DeviceState good = bench.device.state;
    bench.largest_step_N = 0;
    spoil(bench.device.state);
    EXPECT_EQ(bench.run(1, {0, 0, 2}).fault, fault);
    EXPECT_LE(bench.largest_step_N, 2 * 1e-3 / GuardedDevice::kStop_s + 1e-9) << "a ramp, no blow";
    bench.run(20, {0, 0, 2});
    EXPECT_EQ(bench.force_N(), 0) << "within 20 ms";
    bench.device.state = good;
    EXPECT_EQ(bench.run(100, {0, 0, 2}).stage, Stage::kFault) << "latched";
    bench.guard.reset();
    EXPECT_EQ(bench.run(500, {0, 0, 2}).stage, Stage::kReady) << "the grip is still held: no edge";
    EXPECT_EQ(bench.force_N(), 0);
    bench.enable();
    bench.run(50, {0, 0, 2});
    EXPECT_GT(bench.force_N(), 1.9);
  }
}

TEST(GuardedDeviceTest, AWrenchThatIsNotFiniteIsNeverPassedOn) {
  Bench bench;
  bench.enable();
  bench.run(500, {0, 0, 2});
  bench.run(1, {0, kNaN, 2});
  EXPECT_TRUE(spatial::is_finite(bench.device.written));
  EXPECT_EQ(bench.guard.fault(), DeviceFault::kNotFinite);
  bench.run(25, {0, kNaN, 2});
  EXPECT_EQ(bench.force_N(), 0);
}

TEST(GuardedDeviceTest, WhatIsSilentHasNoForceAndComesBackArmed) {
  for (const bool is_unplugged : {false, true}) {
    Bench bench;
    bench.enable();
    bench.run(300, {0, 0, 2});
    if (is_unplugged) bench.device.state.stage = Stage::kAbsent;
    bench.is_streaming = is_unplugged;
    EXPECT_EQ(bench.run(19, {0, 0, 2}).is_live, !is_unplugged) << "20 ms are borne";
    const DeviceState gone = bench.run(2, {0, 0, 2});
    EXPECT_FALSE(gone.is_live);
    EXPECT_EQ(gone.fault, DeviceFault::kSilent);
    EXPECT_EQ(gone.stage, Stage::kAbsent);
    EXPECT_EQ(bench.force_N(), 0);
    bench.is_streaming = true;
    bench.device.state.stage = Stage::kReady;
    ++bench.device.state.opening;
    EXPECT_EQ(bench.run(100, {0, 0, 2}).stage, Stage::kReady) << "without a reset, and without an edge";
    EXPECT_EQ(bench.force_N(), 0);
    bench.enable();
    bench.run(10, {0, 0, 2});
    EXPECT_GT(bench.force_N(), 1.9);
  }
}

TEST(GuardedDeviceTest, AnEventDeviceIsLiveByItsLastPoll) {
  Bench bench;
  bench.is_streaming = false;
  bench.device.state.time_ns = 0;  // its owner says nothing of time: the state is of now
  EXPECT_TRUE(bench.run(100, {}).is_live);
}

TEST(GuardedDeviceTest, TheCapHoldsWhateverIsAsked) {
  for (const double asked_N : {0.0, 3.0, 100.0}) {
    GuardSettings settings{model_of(Enabling::kHold)};
    settings.max_force_N = asked_N;
    Bench bench(settings);
    const double cap_N = asked_N == 0 ? GuardedDevice::kDefaultCap_N : std::min(asked_N, settings.model.max_force_N);
    EXPECT_EQ(bench.guard.capabilities().max_force_N, cap_N);
    bench.enable();
    bench.run(500, {1e6, 1e6, -1e6});
    EXPECT_NEAR(bench.force_N(), cap_N, 1e-9);
  }
}

TEST(GuardedDeviceTest, AFirstEnablingBeginsSoftlyAndRisesWithContact) {
  GuardSettings settings{model_of(Enabling::kHold)};
  settings.is_new_device = true;
  Bench bench(settings);
  bench.enable();
  bench.run(3000, {});  // in the air nothing is learnt
  bench.run(5, {0, 0, 2});
  EXPECT_NEAR(bench.force_N(), 2 * GuardedDevice::kFirstShare, 0.02);
  EXPECT_FALSE(bench.guard.is_trusted());
  bench.run(995, {0, 0, 2});
  EXPECT_NEAR(bench.force_N(), 2 * 0.6, 0.02);
  bench.run(1100, {0, 0, 2});
  EXPECT_NEAR(bench.force_N(), 2, 1e-9);
  EXPECT_TRUE(bench.guard.is_trusted());
  EXPECT_TRUE(Bench().guard.is_trusted());
}

TEST(GuardedDeviceTest, NothingThatMapsTheHandleAnewMakesAStep) {
  using Change = void (*)(DeviceState&);
  for (const Change change : {Change([](DeviceState& s) { ++s.mapping; }), Change([](DeviceState& s) {
                                ++s.mapping;
                                s.X_BD.p.x += 0.08;
                              }),
                              Change([](DeviceState& s) { s.is_clutch_held = true; })}) {
    Bench bench;
    bench.enable();
    bench.run(300, {0, 0, 3});
    EXPECT_NEAR(bench.force_N(), 3, 1e-9);
    change(bench.device.state);
    bench.largest_step_N = 0;
    bench.run(10, {0, -3, 3});
    bench.run(100, {5, 0, -3});
    EXPECT_LE(bench.largest_step_N, GuardedDevice::kGentle_N + 1e-9);
    EXPECT_GT(bench.largest_step_N, 0.1);
    EXPECT_EQ(bench.guard.fault(), DeviceFault::kNone);
  }
}

TEST(GuardedDeviceTest, WallsPushBackSoftlyAndTakeWhatTheyGive) {
  Bench bench;
  bench.enable();
  bench.device.state.X_BD.p = {0.0999, -0.0999, 0};
  bench.run(10, {});
  EXPECT_EQ(bench.force_N(), 0);
  const double rule_N_per_m = coupling_of(model_of(Enabling::kHold)).stiffness_N_per_m;
  double given_J = 0;
  for (int i = 0; i < 400; ++i) {  // 10 mm out and back
    const double out_m = 0.01 * std::sin(std::numbers::pi * i / 400);
    const double before_m = bench.device.state.X_BD.p.x;
    bench.device.state.X_BD.p.x = 0.1 + out_m;
    bench.device.state.V_BD_B.linear_m_s.x = (bench.device.state.X_BD.p.x - before_m) * 1e3;
    given_J += bench.device.written.force_N.x * (bench.device.state.X_BD.p.x - before_m);
    bench.run(1, {});
    EXPECT_LE(bench.device.written.force_N.x, 1e-12);
    EXPECT_LE(-bench.device.written.force_N.x, 0.1 * rule_N_per_m * out_m + 0.1);
  }
  EXPECT_LE(given_J, 1e-6);
}

TEST(GuardedDeviceTest, WhatHoldsTheHandleUpIsWithinTheCapAndIsNoWorkThatCounts) {
  GuardSettings settings{model_of(Enabling::kHold)};
  settings.gravity_B_N = {0, 0, 0.6};
  Bench bench(settings);
  bench.device.state.X_BD.p.z = -0.05;
  bench.enable();
  for (int i = 0; i < 500; ++i) {
    bench.device.state.X_BD.p.z = -0.05 + 2e-4 * i;
    bench.device.state.V_BD_B.linear_m_s.z = 0.2;
    bench.run(1, {});
  }
  EXPECT_EQ(bench.guard.fault(), DeviceFault::kNone);
  EXPECT_NEAR(bench.force_N(), 0.6, 1e-9);
  bench.device.state.V_BD_B.linear_m_s.z = 0;
  bench.run(500, {0, 0, 100});
  EXPECT_NEAR(bench.force_N(), GuardedDevice::kDefaultCap_N, 1e-9);
}

TEST(GuardedDeviceTest, ADeviceThatTakesAnothersPlaceWithinATickHasNoForce) {
  Bench bench;
  bench.enable();
  bench.run(100, {0, 0, 2});
  ++bench.device.state.opening;
  bench.run(1, {0, 0, 2});
  EXPECT_EQ(bench.force_N(), 0);
}

TEST(GuardedDeviceTest, HeatTakesTheForceDownToTheContinuousOne) {
  GuardSettings settings{model_of(Enabling::kHold)};
  settings.model.continuous_force_N = 4;
  settings.model.thermal_time_s = 2;
  settings.max_force_N = 10;
  Bench bench(settings);
  bench.enable();
  bench.run(100, {10, 0, 0});
  EXPECT_NEAR(bench.force_N(), 10, 1e-9) << "for a while it gives all";
  bench.largest_step_N = 0;
  bench.run(10'000, {10, 0, 0});
  EXPECT_NEAR(bench.force_N(), 4, 0.1);
  EXPECT_LE(bench.largest_step_N, 0.2) << "smoothly";
  bench.run(10'000, {3.5, 0, 0});
  EXPECT_NEAR(bench.force_N(), 3.5, 1e-9) << "what it can give for ever is not touched";
}

/// A stalled machine: force of the tick before, and a handle that is found somewhere else.
TEST(GuardedDeviceTest, WhatHappensWhileNobodyWatchesIsNotHeldAgainstTheDevice) {
  const auto lets_go_after = [](double way_m, int ticks, std::int64_t stall_ns) {
    Bench bench;
    bench.enable();
    bench.run(100, {0, 0, 3});
    bench.now_ns += stall_ns;
    for (int i = 0; i < ticks; ++i) {
      bench.device.state.X_BD.p.z += way_m / ticks;
      bench.run(1, {0, 0, 3});
    }
    return bench.run(200, {0, 0, 3}).fault == DeviceFault::kGivesWork;
  };
  EXPECT_TRUE(lets_go_after(0.08, 100, 0)) << "240 mJ that were watched";
  EXPECT_FALSE(lets_go_after(0.08, 1, 100 * kTick_ns));
}

TEST(GuardedDeviceTest, StopIsARampAndTheEndIsZero) {
  Puppet device;
  {
    GuardedDevice guard(device, {model_of(Enabling::kHold)});
    device.write({{0, 0, 0}, {1, 0, 0}});
  }
  EXPECT_EQ(glm::length(device.written.force_N), 0);
  Bench bench;
  bench.enable();
  bench.run(100, {0, 0, 2});
  bench.guard.stop();
  bench.largest_step_N = 0;
  bench.run(21, {0, 0, 2});
  EXPECT_EQ(bench.force_N(), 0);
  EXPECT_LE(bench.largest_step_N, 2 * 1e-3 / GuardedDevice::kStop_s + 1e-9);
}

TEST(GuardedDeviceTest, AxesThatItLacksAreLeftOut) {
  GuardSettings settings{model_of(Enabling::kHold)};
  settings.model.force_dof = 2;
  settings.model.torque_dof = 0;
  Bench bench(settings);
  bench.enable();
  for (int i = 0; i < 300; ++i) {
    bench.now_ns += kTick_ns;
    bench.device.state.time_ns = bench.now_ns;
    (void)bench.guard.read(bench.now_ns);
    bench.guard.write({{1, 1, 1}, {1, 1, 1}});
  }
  EXPECT_EQ(bench.device.written.force_N, glm::dvec3(1, 1, 0));
  EXPECT_EQ(bench.device.written.torque_Nm, glm::dvec3(0));
}

/// Whatever comes in, in any order: no more than the cap, no step beyond the ramps, no force without an edge.
TEST(GuardedDeviceTest, RandomHostileInputNeverBreaksALimit) {
  int enabled = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    std::mt19937_64 random(seed);
    const auto uniform = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    const auto hostile = [&](double size) {
      switch (random() % 3000) {
        case 0:
          return kNaN;
        case 1:
          return std::numeric_limits<double>::infinity();
        case 2:
          return 1e300 * uniform(-1, 1);
        default:
          return size * uniform(-1, 1);
      }
    };
    GuardSettings settings{model_of(static_cast<Enabling>(random() % 3))};
    settings.is_new_device = random() % 2 == 0;
    settings.model.thermal_time_s = random() % 2 == 0 ? 0.5 : 0;
    Puppet device;
    GuardedDevice guard(device, settings);
    const double cap_N = guard.capabilities().max_force_N, cap_Nm = guard.capabilities().max_torque_Nm;
    std::int64_t now_ns = 1'000'000'000;
    for (int i = 0; i < 4000; ++i) {
      const std::int64_t tick_ns = random() % 20 == 0 ? static_cast<std::int64_t>(uniform(-1e6, 30e6)) : kTick_ns;
      now_ns += tick_ns;
      if (random() % 100 == 0) device.state.buttons = static_cast<std::uint32_t>(random());
      if (random() % 400 == 0) device.state.stage = static_cast<Stage>(random() % kStages);
      if (random() % 100 == 0) device.state.stage = Stage::kReady;
      if (random() % 300 == 0) device.state.is_live = !device.state.is_live;
      if (random() % 500 == 0) ++device.state.opening;
      if (random() % 200 == 0) ++device.state.mapping;
      if (random() % 200 == 0)
        guard.hold_station_key_until(now_ns + static_cast<std::int64_t>(random() % 100) * kTick_ns);
      if (random() % 200 == 0) guard.reset();
      if (random() % 400 == 0) device.state.X_BD.p.x = hostile(0.2);
      if (random() % 50 == 0) device.state.X_BD.p = glm::dvec3(uniform(-1e-3, 1e-3));
      device.state.V_BD_B.linear_m_s.y = random() % 1000 == 0 ? hostile(3) : uniform(-0.1, 0.1);
      device.state.time_ns = random() % 100 == 0 ? static_cast<std::int64_t>(hostile(1) == 0) : now_ns;
      const DeviceState state = guard.read(now_ns);
      const spatial::Wrench before = device.written;
      guard.write({{hostile(1), 0, 0}, {hostile(20), hostile(20), hostile(20)}});
      const spatial::Wrench after = device.written;
      ASSERT_TRUE(spatial::is_finite(after));
      ASSERT_LE(glm::length(after.force_N), cap_N * (1 + 1e-12));
      ASSERT_LE(glm::length(after.torque_Nm), cap_Nm * (1 + 1e-12));
      enabled += state.stage == Stage::kEnabled;
      const double dt_s = 1e-9 * static_cast<double>(std::clamp<std::int64_t>(tick_ns, 0, 5'000'000));
      const double most_N = settings.model.max_force_rate_N_per_s * dt_s + cap_N * dt_s / GuardedDevice::kStop_s +
                            cap_N * dt_s / GuardedDevice::kFirst_s;
      if (state.fault == DeviceFault::kSilent) {
        ASSERT_EQ(glm::length(after.force_N), 0);
      } else {
        ASSERT_LE(glm::length(after.force_N - before.force_N), most_N + 1e-9) << "tick " << i;
      }
      if (state.stage == Stage::kReady || state.stage == Stage::kAbsent) {
        ASSERT_EQ(glm::length(after.force_N), 0);
      }
    }
  }
  EXPECT_GT(enabled, 3'000) << "much of it with force on";
}

}  // namespace
}  // namespace farfeel::devices
