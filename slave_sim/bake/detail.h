// What is felt in the fewest bytes: heights that follow from a mesh (codecs/asset/followed_heights.h), which takes the
// place of the tiles of a bake.
#pragma once

#include <cstdint>
#include <optional>

#include "slave_sim/bake/bake.h"
#include "slave_sim/bake/full_surface.h"

namespace farfeel::slave_sim {

/// Makes details of more or fewer triangles for one bake.
class Details {
 public:
  /// Both must outlive it. Precondition: baked in few bytes (BakeOptions::height_step_m).
  Details(const Baked&, const geometry::TriangleMesh& full, const BakeOptions&);

  /// The bake with heights that follow from about so many triangles of the mesh, moved so that the curved surface
  /// through them runs through its middle, their vertices within a third of rms_m; its report says what it is off by.
  /// Nothing where that cannot be stored. More than the mesh has: its triangles are divided.
  [[nodiscard]] std::optional<Baked> with(std::uint32_t triangles, double rms_m) const;
  /// Four times those of a mesh that is small enough to divide; else as many as it has.
  [[nodiscard]] std::uint32_t most_triangles() const;

 private:
  const Baked& baked_;
  geometry::TriangleMesh full_, left_out_, to_simplify_;  ///< in the asset's frame
  FullSurface surface_;
};

/// Bytes of what is felt.
[[nodiscard]] std::size_t felt_bytes(const codecs::Asset&);

}  // namespace farfeel::slave_sim
