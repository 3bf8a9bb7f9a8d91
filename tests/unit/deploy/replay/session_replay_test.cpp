#include "deploy/replay/session_replay.h"

#include <gtest/gtest.h>

#include "haptic_core/penetration/simd/simd.h"

namespace farfeel::replay {
namespace {

class SessionReplay : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto held = hold_to_avx2(); !held) GTEST_SKIP() << held.error();
    recording_ = codecs::read_recording(bytes_of(FARFEEL_RECORDING).value()).value();
    asset_ = asset_of(recording_, FARFEEL_RECORDING).value();
    for (codecs::Stream& stream : recording_.streams) stream.records.resize(200);
    recording_ = replay(recording_, asset_, {}).value().anew;  // as this build has it, whichever that is
  }
  codecs::Recording recording_;
  codecs::FeltAsset asset_;
};

TEST_F(SessionReplay, HoldsTheKernelsToAvx2) {
  EXPECT_EQ(penetration::instruction_set_name(), "avx2");
  EXPECT_NE(made_here(recording_).find("avx2 kernels"), std::string::npos);
}

TEST_F(SessionReplay, IsAsRecorded) {
  const auto replayed = replay(recording_, asset_, {});
  ASSERT_TRUE(replayed) << replayed.error();
  EXPECT_EQ(replayed->difference, "");
  EXPECT_EQ(replayed->ticks, 200);
  EXPECT_EQ(replayed->answers, 200);
  EXPECT_EQ(replayed->anew, recording_);
}

TEST_F(SessionReplay, RecordedAnewWithValuesItSaysByHowMuchItDiffers) {
  codecs::Recording anew = replay(recording_, asset_, {.keeps_values = true})->anew;
  EXPECT_TRUE(anew.has_values);
  EXPECT_EQ(replay(anew, asset_, {})->difference, "");
  codecs::Outcome& outcome = anew.streams[0].records[150].outcome;
  const auto& names = anew.streams[0].outputs;
  const auto at = std::find(names.begin(), names.end(), "hand's force F_hand_W") - names.begin();
  double& force = outcome.values[static_cast<std::size_t>(at)][5];
  force = force * (1 + 1e-13);
  outcome.hash ^= 1;
  const std::string difference = replay(anew, asset_, {})->difference;
  EXPECT_EQ(difference.find("ticks 150: hand's force F_hand_W: number 5"), 0) << difference;
  EXPECT_EQ(replay(anew, asset_, {.within = 1e-12})->difference, "");
}

TEST_F(SessionReplay, WhatItDoesNotKnowIsRefused) {
  codecs::Recording other = recording_;
  other.settings.names.push_back("loop.magic"), other.settings.values.push_back(1);
  EXPECT_NE(replay(other, asset_, {}).error().find("loop.magic"), std::string::npos);
  other = recording_;
  other.streams[0].name = "pictures";
  EXPECT_FALSE(replay(other, asset_, {}));
  other = recording_;
  other.streams[0].outputs[0] = "something else";
  EXPECT_FALSE(replay(other, asset_, {}));
}

TEST_F(SessionReplay, AnotherAssetIsNotTaken) {
  codecs::Recording other = recording_;
  other.assets[0] ^= 1;
  EXPECT_FALSE(asset_of(other, FARFEEL_RECORDING));
}

}  // namespace
}  // namespace farfeel::replay
