// The question every penetration back end answers, and the interface they share.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <span>

#include "haptic_core/penetration/felt_surface.h"
#include "haptic_core/penetration/penetration.h"

namespace farfeel::penetration {

/// The part of one surface that takes part in a contact: some of its coarse triangles, posed in C. The object's own
/// frame O is S or T; T's origin is To. X_CO must have been formed in double with C's origin near the contact: that
/// subtraction is what keeps a contact exact a kilometre from the world's origin.
struct Patch {
  const FeltSurface* surface = nullptr;
  spatial::Pose X_CO;
  std::span<const std::uint32_t> triangles;  ///< of surface->haptic().coarse; those facing away are ignored
};

/// The part of C's x-y plane that is searched and integrated over [m]; low <= high.
struct Window {
  glm::dvec2 low{0}, high{0};
};

inline constexpr double kDefaultSoftWidth_m = 10e-6;
/// a0 of the soft maximum: about what one ridge crossing carries at the default width, so that soft and hard depths of
/// textured contacts agree within a few widths.
inline constexpr double kReferenceArea_m2 = 1e-7;
/// Along a patch's own edges its weight in the integral fades from one to zero over this distance, as if the edge
/// were rounded: depth and gradient stay continuous when an edge slides over a surface.
inline constexpr double kEdgeFade_m = 0.2e-3;

struct Query {
  Patch s, t;
  /// Tells a contact again from one call to the next; 0: its place in the list does. What a back end remembers of
  /// it saves time.
  std::uint32_t contact = 0;
  bool is_second = false;  ///< another question about that contact, beside the first: remembered by itself
  Window window;
  std::uint32_t samples = 50;                 ///< N: the (first) grid has at most N x N cells, 1 <= N <= kMaxSamples
  double soft_width_m = kDefaultSoftWidth_m;  ///< 0 asks for the hard maximum
  /// Where it is less than soft_width_m, the depth alone is that of this width: TwoWidths sees to it, for any back end.
  /// 0: both are the same.
  double depth_width_m = 0;
  bool refines = true;  ///< false, for the hard maximum: the grid's best cell as it is, as the source did
  bool wants_hessian = false;
  /// The second derivative as the gradient's own sums tell it, where a back end has them: good enough to judge how
  /// stiff a contact is, for a fraction of its cost. Without effect beside wants_hessian.
  bool estimates_hessian = false;
  /// Coarse overlaps beyond this belong to another layer (a shelf above the tool, the far side of a wall): ignored [m].
  double deepest_m = std::numeric_limits<double>::infinity();
};

inline constexpr std::uint32_t kMaxSamples = 400;

/// What a back end's caller may do, and need not do itself.
struct Traits {
  /// It finds a contact's extent within the query's window; else the window must fit the contact.
  bool finds_extent = false;
  /// The caller may answer in its place with what is as good: a closed form, another contact's answer, or the last one
  /// carried on. False where the algorithm itself is asked for: a truth, or a comparator.
  bool may_substitute = false;
  bool has_hessian = false;  ///< it knows Query::wants_hessian and estimates_hessian; else they stay false
  bool batches = false;      ///< the queries of one call take less time than as many calls
};

/// One back end with its workspace. Belongs to one thread at a time.
class BackEnd {
 public:
  virtual ~BackEnd() = default;
  /// The same ones always.
  [[nodiscard]] virtual Traits traits() const noexcept = 0;
  /// Queries will name this surface, which outlives the back end. Beforehand: it may allocate and take its time.
  virtual void prepare(const FeltSurface&) {}
  /// Answers every query; both spans have one length. Realtime-safe: allocates nothing, cannot fail.
  virtual void evaluate(std::span<const Query>, std::span<Penetration>) noexcept = 0;
  /// Answers so far for which everything was searched: the costly ones, where a back end can tell. The others were made
  /// from what earlier ones kept.
  [[nodiscard]] virtual std::uint64_t searches() const noexcept { return 0; }
  /// Forgets what it remembers of contacts, so that their numbers may begin anew. Realtime-safe.
  virtual void restart() noexcept {}
};

/// Largest coarse triangle count of any surface the back end will see; sizes its workspace.
struct Limits {
  std::size_t coarse_triangles = 1u << 14;
};

/// Makes the back end that somebody has chosen, one on a GPU, say. Any thread; it may allocate and take its time.
/// Empty: none was chosen, and simd is taken.
using BackEndMaker = std::function<std::unique_ptr<BackEnd>(const Limits&)>;

}  // namespace farfeel::penetration
