// The benchmark scenes as benchmarks use them: two models, and motions of one over the other.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codecs/asset/asset.h"
#include "haptic_core/penetration/back_end.h"
#include "tests/bench/recorded_motion.h"

namespace farfeel::bench {

struct BenchmarkScene {
  std::string name;
  codecs::Asset object, tool;  ///< S, standing at the world's origin, and T
  double tolerance_m;
  MotionPlan plan;
  std::optional<MotionWanted> wanted;  ///< of its motions
  penetration::BackEndMaker maker{};   ///< of the back end that is measured; empty: simd

  [[nodiscard]] std::vector<spatial::Pose> motion(std::uint64_t seed, std::size_t frames) const;
};

[[nodiscard]] std::span<const std::string_view> benchmark_scene_names();
/// Bakes the models at first use, or throws CLI::Error with what is wrong.
[[nodiscard]] BenchmarkScene benchmark_scene(std::string_view name);
/// The same of assets that somebody has, however they were baked.
[[nodiscard]] BenchmarkScene benchmark_scene(std::string_view name, codecs::Asset object, codecs::Asset tool);

}  // namespace farfeel::bench
