// A facing patch in float, in the plain arrays that the simd kernels read.
#pragma once

#include <array>
#include <vector>

#include "haptic_core/penetration/facing_patch.h"
#include "haptic_core/penetration/simd/simd_kernels.h"

namespace farfeel::penetration {

class LanePatch {
 public:
  LanePatch(const Limits&, Side);

  /// Takes over the facets and edges of a patch that was projected with the same side. Allocates nothing.
  void copy(const FacingPatch&, const FeltSurface&) noexcept;
  /// Chooses each chart's level of bounds for cells that reach `reach_m` from their centre, where heights are known
  /// beforehand to within the relief (false) or as well as a cell's parent knows them (true).
  /// None is needed where even the greatest bend adds less than small_m to a cell.
  void suit(double reach_m, bool has_guess, double small_m) noexcept;

  [[nodiscard]] simd::LaneSide side() const noexcept;
  /// Box of all facets in C's plane, and the least texel of any; infinite without texture.
  [[nodiscard]] const Window& box() const { return box_; }
  [[nodiscard]] double finest_texel_m() const { return finest_texel_m_; }

 private:
  struct Boxes {
    std::vector<float> low_u, high_u, low_v, high_v;

    void reserve(std::size_t count);
    /// Room for so many, filled up to whole vectors with boxes that hold nothing.
    void resize(std::size_t count) noexcept;
    void set(std::size_t i, const glm::dvec2& low, const glm::dvec2& high) noexcept;
    [[nodiscard]] simd::LaneBoxes lanes() const noexcept;
  };

  /// Index of what the facet is felt by.
  [[nodiscard]] std::int32_t chart_of(const Facet&) noexcept;

  Side which_;
  const FeltSurface* felt_ = nullptr;
  std::vector<simd::LaneFacet> facets_;
  std::vector<simd::LaneChart> charts_;
  std::vector<std::uint32_t> chart_indices_;  // the surface's, of charts_
  std::vector<simd::LaneEdge> edges_;
  std::array<std::vector<float>, 9> facet_edges_;  // three columns an edge
  Boxes facet_boxes_, edge_boxes_;
  Window box_;
  double finest_texel_m_ = 0;
};

}  // namespace farfeel::penetration
