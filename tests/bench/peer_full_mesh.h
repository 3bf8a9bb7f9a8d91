// What the full-resolution meshes say, by ray casting (Embree) and exactly: peers of the penetration back ends.
#pragma once

#include <memory>

#include "tests/bench/penetration_pairs.h"

namespace farfeel::bench {

/// Both plates of a pair as meshes of 65,536 triangles.
class FullMeshes {
 public:
  explicit FullMeshes(const PlatePair&);
  ~FullMeshes();

  /// Greatest overlap over a grid of samples x samples rays, in the window.
  [[nodiscard]] double cast_m(const spatial::Pose& X_CT, std::uint32_t samples) const;
  /// Greatest overlap of the two piecewise linear surfaces over the window: the overlap of two triangles is linear, so
  /// a corner of what they share decides.
  [[nodiscard]] double exact_m(const spatial::Pose& X_CT) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace farfeel::bench
