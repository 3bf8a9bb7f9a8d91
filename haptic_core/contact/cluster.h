// One coarse contact between scene object S and tool T: near pairs of convex pieces that touch in the same place and
// from the same side.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace farfeel::contact {

inline constexpr std::size_t kMaxClusterPieces = 64;  ///< on each side; the farthest are left out beyond that

/// Up to kMaxClusterPieces different pieces, the most weighty first.
struct PieceList {
  std::uint32_t count = 0;
  std::array<std::uint32_t, kMaxClusterPieces> pieces{};

  [[nodiscard]] std::span<const std::uint32_t> view() const { return {pieces.data(), count}; }
};

/// In S's frame. A pair weighs (tolerance - distance) times how squarely its direction leaves S and enters T:
/// nothing when it grazes either.
struct Cluster {
  std::uint32_t id = 0;     ///< >= 1; persists while the cluster does; never used twice
  glm::dvec3 p_S{0};        ///< follows the weighted mean of the witnesses' midpoints [m]
  glm::dvec3 nhat_ST_S{0};  ///< unit; follows the weighted mean of the pairs' directions
  double depth_m = 0;       ///< follows the deepest pair's overlap; < 0 apart
  double lateral_m = 0;     ///< farthest witness from p_S, measured across nhat
  double weight_m = 0;      ///< sum over pairs, > 0
  std::uint32_t pairs = 0;  ///< >= 1
  PieceList pieces_s, pieces_t;
};

/// How much a pair counts, in [0, 1], by its ProximityPair::facing. One whose direction grazes either surface is one
/// that another pair, squarer on, tells better: a face and the wall that it runs up to, whose least translation leads
/// sideways out of both. It fades out before it becomes that.
[[nodiscard]] double squareness(double facing) noexcept;

}  // namespace farfeel::contact
