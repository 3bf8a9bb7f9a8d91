// Real contacts of the built-in scenes and of a textured plate, felt as they come over the wire: how far that is from
// full precision, and that it takes no more than was promised.
#include "tests/bench/wire_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <ostream>
#include <string>

namespace farfeel::bench {
namespace {

constexpr double kMostError = 0.005;
constexpr std::size_t kFrames = 3000;

struct Case {
  const char* scene;
  local_model::Rung rung;
  int round_trip_ms;
  std::uint64_t motion = 2;  ///< which is drawn
  friend std::ostream& operator<<(std::ostream& out, const Case& c) {
    std::string scene = c.scene;
    std::replace(scene.begin(), scene.end(), '-', '_');
    return out << scene << '_' << name(c.rung) << '_' << c.round_trip_ms << "ms_" << c.motion;
  }
};

class WireErrorTest : public ::testing::TestWithParam<Case> {};

TEST_P(WireErrorTest, IsBelowHalfAPercent) {
  const Case& c = GetParam();
  const WireScene scene = wire_scene(c.scene, c.motion, kFrames);
  const WireError error = wire_error(scene, {c.rung, c.round_trip_ms, false});
  EXPECT_GT(error.touching, error.ticks / 2);
  EXPECT_LT(error.force.p99_9, kMostError);
  EXPECT_LT(error.torque.p99_9, kMostError);
  EXPECT_EQ(error.pose_bytes, 64);
  if (c.rung == local_model::Rung::kLinear) {
    EXPECT_LE(1e-6 * 8 * 1000 * (61 + error.by_seven_bytes), 3) << "Mbit/s with seven contacts";
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, WireErrorTest,
                         ::testing::Values(Case{"file-cad", local_model::Rung::kLinear, 20},
                                           Case{"block-gear", local_model::Rung::kLinear, 20},
                                           // A gear rocks on a line: what is kept of it must not hang on rounding.
                                           Case{"block-gear", local_model::Rung::kLinear, 20, 7},
                                           Case{"block-gear", local_model::Rung::kLinear, 20, 12},
                                           Case{"hammer-torus", local_model::Rung::kLinear, 20},
                                           Case{"roughness", local_model::Rung::kLinear, 100},
                                           Case{"roughness", local_model::Rung::kQuadratic, 20}),
                         ::testing::PrintToStringParamName());

}  // namespace
}  // namespace farfeel::bench
