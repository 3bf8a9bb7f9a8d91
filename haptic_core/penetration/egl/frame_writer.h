// A query as the words that the compute shaders read.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "haptic_core/penetration/egl/frame_layout.h"
#include "haptic_core/penetration/egl/height_store.h"
#include "haptic_core/penetration/facing_patch.h"

namespace farfeel::penetration::egl {

/// What a facet's relief may do, along C's z axis and across its chart; see Facet.
struct ReliefReach {
  double up_m, down_m, most_drift_m;
};
/// The record of the chart that carries a facet, posed in C.
[[nodiscard]] std::array<Word4, kChartWords> chart_words(const Facet&, const FeltSurface&, const SurfacePlace::Chart&,
                                                         const ReliefReach&) noexcept;

/// Where the peak may be, and the size of the cells that are looked at there first.
struct Recall {
  glm::dvec2 uv_m{0};
  double cell_m = 0;
};

struct WrittenContact {
  std::uint32_t words = 0;  ///< 0: the patches share no part of the window
  Window searched;
};

/// Belongs to one thread. Writes forwards and never reads what it wrote: the words may stand in memory that is slow to
/// read.
class FrameWriter {
 public:
  explicit FrameWriter(const Limits&);

  /// first_word: of words[0], as the shaders count. Nothing where the words do not suffice. Allocates nothing.
  [[nodiscard]] std::optional<WrittenContact> write(const Query&, const SurfacePlace& s, const SurfacePlace& t,
                                                    const std::optional<Recall>&, std::span<Word4> words,
                                                    std::uint32_t first_word) noexcept;

  /// The patches of the last query written.
  [[nodiscard]] const FacingPatch& s() const { return s_; }
  [[nodiscard]] const FacingPatch& t() const { return t_; }

 private:
  /// A patch's facets in the order of their charts.
  struct Sorted {
    std::vector<std::uint32_t> facets;         // indices
    std::vector<std::uint32_t> chart_of;       // slot of each of those, kNoTriangle for a bare one
    std::vector<std::uint32_t> charts, first;  // chart and one of its facets, by slot
    std::vector<float> up, down, drift;        // of the slots: over all their facets
    Window box;
    double finest_texel_m = 0;
  };
  static void sort(const FacingPatch&, const Window&, Sorted&) noexcept;

  FacingPatch s_, t_;
  Sorted s_sorted_, t_sorted_;
};

}  // namespace farfeel::penetration::egl
