#include "master_station/recording/tick_fields.h"

#include <gtest/gtest.h>

namespace farfeel::master_station {
namespace {

RecordedLoop any_loop() {
  RecordedLoop loop;
  loop.settings.timing.period_ns = 500'000;
  loop.settings.X_WB.p = {1, 2, 3};
  loop.settings.local_model.rung = local_model::Rung::kQuadratic;
  loop.settings.local_model.tank.cap_J = 0.25;
  loop.settings.integrator = tool::Integrator::kMidpoint;
  const std::vector<motion::Keyframe> keys{{0, {}}, {1, {{1, 0, 0, 0}, {0, 0, 0.5}}}, {2, {}}};
  loop.settings.moving = {{4, motion::ScriptedMotion(keys, motion::Afterwards::kRepeats)}};
  loop.capabilities.max_force_N = 9;
  loop.has_outline = true;
  return loop;
}

tl::expected<RecordedLoop, std::string> read(const codecs::Numbers& numbers) {
  codecs::NumberReader reader(numbers.names, numbers.values);
  auto loop = loop_in(reader);
  EXPECT_EQ(reader.unasked(), "");
  return loop;
}

TEST(TickFields, ALoopIsReadAsItWasWrittenItsScriptsToo) {
  const codecs::Numbers numbers = numbers_of(any_loop());
  const auto loop = read(numbers);
  ASSERT_TRUE(loop) << loop.error();
  EXPECT_EQ(numbers_of(*loop), numbers);
  ASSERT_EQ(loop->settings.moving.size(), 1);
  EXPECT_EQ(loop->settings.moving[0].object, 4);
  EXPECT_EQ(loop->settings.moving[0].script->keys().size(), 3);
}

TEST(TickFields, AbsurdLoopsAreRefused) {
  const auto refuses = [](auto&& change) {
    RecordedLoop loop = any_loop();
    change(loop.settings);
    return !read(numbers_of(loop));
  };
  EXPECT_FALSE(refuses([](HapticLoopSettings&) {}));
  EXPECT_TRUE(refuses([](HapticLoopSettings& s) { s.timing.period_ns = 0; }));
  EXPECT_TRUE(refuses([](HapticLoopSettings& s) { s.body.mass_kg = std::nan(""); }));
  EXPECT_TRUE(refuses([](HapticLoopSettings& s) { s.X_TG.R = {0, 0, 0, 0}; }));
  EXPECT_TRUE(refuses([](HapticLoopSettings& s) { s.local_model.rung = static_cast<local_model::Rung>(9); }));
}

TEST(TickFields, InputsAreReadAsTheyWereWritten) {
  TickInputs inputs;
  inputs.timing = {7'000'000, 12, 34, 5};
  inputs.is_reset = true;
  inputs.device.X_BD.p = {1, 2, 3};
  inputs.device.stage = devices::Stage::kFault;
  inputs.device.fault = DeviceFault::kTooFast;
  inputs.is_given_as_asked = false, inputs.F_given_B.force_N = {4, 5, 6};
  inputs.hand_energy_J = -0.5;
  const codecs::Numbers numbers = numbers_of(inputs);
  codecs::Stream stream;
  stream.inputs = numbers.names;
  const TickInputs again = inputs_in(stream, {numbers.values, {}, {}});
  EXPECT_EQ(numbers_of(again), numbers);
  EXPECT_EQ(again.device.fault, DeviceFault::kTooFast);
  EXPECT_EQ(again.F_given_B, inputs.F_given_B);
}

}  // namespace
}  // namespace farfeel::master_station
