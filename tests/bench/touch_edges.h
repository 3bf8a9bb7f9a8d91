// Free edges of a mesh (rims, fins, holes, steps, spikes: whatever stands out sharply), and the ways of a ball along
// and across them that never touch anything.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tests/bench/touch_places.h"

namespace farfeel::bench {

/// A convex edge of a mesh, seen so that its left triangle runs along it.
struct FreeEdge {
  std::uint32_t from = 0, to = 0;  ///< vertices
  glm::dvec3 nhat_left_O, nhat_right_O;
};

/// Edges where the surface turns away by more than kLeastTurn_rad.
inline constexpr double kLeastTurn_rad = 0.7;

/// The mesh outlives it.
class FreeEdges {
 public:
  explicit FreeEdges(const geometry::TriangleMesh& mesh_O);
  [[nodiscard]] bool is_empty() const { return edges_.empty(); }
  [[nodiscard]] const std::vector<FreeEdge>& edges() const { return edges_; }

  [[nodiscard]] glm::dvec3 from_O(const FreeEdge& e) const { return mesh_.positions_O[e.from]; }
  [[nodiscard]] glm::dvec3 along_O(const FreeEdge& e) const { return mesh_.positions_O[e.to] - from_O(e); }
  /// The edge that share of all edges' length leads to.
  [[nodiscard]] const FreeEdge& at_share(double share) const;
  /// The same edge seen from its other triangle.
  [[nodiscard]] static FreeEdge reversed(const FreeEdge&);
  /// What goes on straightest from the edge's end; none where all turn by more than 45 degrees.
  [[nodiscard]] std::optional<FreeEdge> after(const FreeEdge&) const;

 private:
  const geometry::TriangleMesh& mesh_;
  std::vector<FreeEdge> edges_;
  std::vector<double> length_up_to_m_;
  std::vector<std::vector<std::uint32_t>> at_vertex_;  // edges
};

/// A ball's way beside an edge, clear of everything by one distance all along.
struct Passage {
  bool is_across = false;       ///< over the edge; else along it
  Place pressed;                ///< the same edge, pressed at the middle of the way
  std::vector<glm::dvec3> p_O;  ///< the ball's middles
  double speed_m_s = 0, step_m = 0;
};

inline constexpr double kClearWithin_m = 0.5e-6;  ///< what a passage's distance may be off by

/// The index-th passage of a model and ball: a function of these and the seed. None where no edge that was drawn has
/// room for the ball.
[[nodiscard]] std::optional<Passage> passage_on(const TouchSubject&, const FreeEdges&, const TouchTool& ball,
                                                double clear_m, std::uint64_t seed, std::uint32_t index);

}  // namespace farfeel::bench
