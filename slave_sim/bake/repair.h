// From what a file said to a closed, oriented surface: repaired with a word about each repair, or refused.
#pragma once

#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

struct RepairError {
  std::string message;             ///< what is wrong, where, and what to do
  std::vector<std::string> notes;  ///< what had been mended by then
};

struct Repaired {
  geometry::TriangleMesh mesh;      ///< closed, oriented, facing outwards, finite
  geometry::TriangleMesh left_out;  ///< specks and fins that were dropped, as far as they are outside of `mesh`
  std::vector<std::string> notes;   ///< one a repair, in words, how many and where the first is
  bool was_sound = true;            ///< nothing was mended; a format without indices has its corners joined anyway
};

/// What becomes of a surface that is open.
struct Openings {
  std::optional<double> widest_m = std::nullopt;  ///< wider ones are not filled; unsaid: a third of the size
  /// What is still open then, or with widest_m unsaid all that is open, is a sheet that is so thick (thicken.h);
  /// unsaid: refused.
  std::optional<double> thickness_m = std::nullopt;
};

/// Joins corners that coincide, drops degenerate and doubled triangles and unused vertices, cuts edges at T-junctions,
/// turns triangles that face the wrong way, drops shells that are specks and sheets that hang on an edge (fins), gives
/// solids that share an edge their own, closes holes or makes sheets thick as Openings says, and turns shells:
/// outwards, or inwards where they are cavities (shells.h). Refuses: nothing left, coordinates that are not finite, a
/// size outside 1 mm .. 10 m (wrong unit), edges with more than two triangles that all this does not cure, surfaces
/// with one side only (Moebius), large openings.
[[nodiscard]] tl::expected<Repaired, RepairError> repaired(const geometry::TriangleMesh&, double metres_per_unit = 1,
                                                           const Openings& = {});

}  // namespace farfeel::slave_sim
