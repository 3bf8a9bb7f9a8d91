// A back end leaves out what overlaps by more than deepest_m when coarse. The felt surface leaves a coarse triangle's
// plane along z by its relief times (axis . n) / n.z, so over the triangles that face each other no overlap is more
// than
//   deepest_m + greatest rise of S's + greatest rise of T's,
// and a soft maximum over an area A is more than the greatest overlap by at most w ln(A / a0).
#include "haptic_core/contact_service/far_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfeel::contact_service {
namespace {

/// Who is so far from touching is not told apart from touching by a rounding, nor by a coarse pair's floor.
constexpr double kClearly_m = 0.1e-3;
constexpr double kQuadratureWidths = 3;  ///< that a sum may be off by
constexpr double kLeastFacing = 0.5;     ///< cosine; what faces less squarely is no part of a patch

/// How far the felt surface stands out of its coarse triangles, along z, towards the other: outward is C's z axis for S
/// and its opposite for T.
double greatest_rise_m(const penetration::Patch& patch, const glm::dvec3& outward_C) {
  const glm::dvec3 outward_O = spatial::rotate_back(patch.X_CO, outward_C);
  double most_m = -std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : patch.triangles) {
    const glm::dvec3& n_O = patch.surface->unit_normal_O(i);
    const double facing = glm::dot(n_O, outward_O);
    if (!(facing > 0)) continue;
    const std::uint32_t chart = patch.surface->haptic().triangle_chart[i];
    const double along = chart == geometry::kNoChart ? 0 : glm::dot(patch.surface->chart_axis_O(chart), n_O);
    const double stretch = along / std::max(facing, kLeastFacing);
    const penetration::Relief& relief = patch.surface->relief(i);
    most_m = std::max({most_m, stretch * relief.low_m, stretch * relief.high_m});
  }
  return most_m;
}

}  // namespace

FarContacts::FarContacts(const penetration::FeltSurface& tool) {
  glm::dvec3 low{std::numeric_limits<double>::infinity()}, high = -low;
  for (const glm::dvec3& p : tool.haptic().coarse.positions_O) low = glm::min(low, p), high = glm::max(high, p);
  const glm::dvec3 size = high - low;
  tool_area_m2_ = std::max(glm::dot(size, size), penetration::kReferenceArea_m2);
}

double FarContacts::most_depth_m(const penetration::Query& query) const noexcept {
  const double w = query.soft_width_m;
  return query.deepest_m + greatest_rise_m(query.s, {0, 0, 1}) + greatest_rise_m(query.t, {0, 0, -1}) +
         w * (std::log(tool_area_m2_ / penetration::kReferenceArea_m2) + kQuadratureWidths);
}

bool FarContacts::takes(const penetration::Query& query, std::size_t i, penetration::Penetration& depth) noexcept {
  const double most_m = most_depth_m(query);
  if (!(most_m < -kClearly_m)) return false;
  const penetration::Carried& last = slot_of(query);
  double urgent = std::numeric_limits<double>::infinity();
  depth = {};
  if (last.is_of(query)) {
    urgent = last.way_m(query) / -most_m;
    depth = last.carried_to(query);
    depth.depth_m = std::min(depth.depth_m, most_m);
  }
  if (urgent > most_urgent_) most_urgent_ = urgent, turn_ = {i, query};
  return true;
}

}  // namespace farfeel::contact_service
