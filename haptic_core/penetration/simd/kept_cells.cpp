#include "haptic_core/penetration/simd/kept_cells.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/ablation/ablation.h"

namespace farfeel::penetration {
namespace {

/// As many as a sum has nodes at most: 120 kB a contact.
constexpr std::int32_t kRoom = 6'144;
/// How far a patch's edge may move: a flat surface is felt up to where its fade has left little. What does not fade yet
/// is as far away as the fade is wide.
constexpr double kMostAcrossAtEdge_m = kEdgeFade_m / 4, kMostAcross_m = kEdgeFade_m / 2;
/// Whatever else has changed, a layer that came into reach say, is found after so many answers.
constexpr std::uint32_t kMostCarried = 32;
constexpr double kSameWidth = 0.05;  ///< soft widths that differ by less of themselves

/// The same for the same triangles in whatever order, and hardly ever for others.
std::uint64_t mixed(const Query& query) {
  std::uint64_t sum = 0;
  const auto add = [&sum](std::span<const std::uint32_t> triangles, std::uint64_t odd) {
    for (const std::uint32_t i : triangles) {
      const std::uint64_t x = (i + 1) * odd;
      sum += x ^ x >> 29;
    }
  };
  add(query.s.triangles, 0x9E37'79B9'7F4A'7C15u);
  add(query.t.triangles, 0xBF58'476D'1CE4'E5B9u);
  return sum;
}

std::uint64_t changes_of(const Query& query) {
  return query.s.surface->changes() + query.t.surface->changes();
}

}  // namespace

KeptCells::KeptCells() {
  for (auto& column : columns_) column.resize(kRoom + simd::kMostLanes);
}

simd::CellStore KeptCells::store(float lowest) noexcept {
  drop();
  return {.u = columns_[0].data(),
          .v = columns_[1].data(),
          .s_z = columns_[2].data(),
          .t_z = columns_[3].data(),
          .stands = columns_[4].data(),
          .lowest = lowest,
          .room = kRoom,
          .count = 0};
}

void KeptCells::keep(const Query& query, const Search& search, std::int32_t count) noexcept {
  search_ = search;
  count_ = count;
  carried_ = 0;
  level_m_ = search.best_m;
  X_CS_ = query.s.X_CO, X_CT_ = query.t.X_CO;
  p_SQ_ = spatial::transform_point(spatial::inverse(X_CS_), search.p_CQ);
  p_TQ_ = spatial::transform_point(spatial::inverse(X_CT_), search.p_CQ);
  const glm::dvec2 Q{search.p_CQ};
  radius_m_ = glm::length(glm::max(glm::abs(search.searched.high - Q), glm::abs(search.searched.low - Q)));
  window_ = query.window;
  soft_width_m_ = query.soft_width_m;
  triangles_ = mixed(query);
  changes_ = changes_of(query);
}

bool KeptCells::still_hold(const Query& query, Place& place) noexcept {
  if (ablated(Mechanism::kKeptCells) || count_ == 0 || ++carried_ > kMostCarried || changes_ != changes_of(query))
    return false;
  if (std::abs(query.soft_width_m - soft_width_m_) > kSameWidth * soft_width_m_) return false;
  place.shift_m = glm::dvec2{query.s.X_CO.p} - glm::dvec2{X_CS_.p};
  const glm::dvec3 s_move = spatial::transform_point(query.s.X_CO, p_SQ_) - search_.p_CQ,
                   t_move = spatial::transform_point(query.t.X_CO, p_TQ_) - search_.p_CQ;
  place.s_lift_m = s_move.z, place.t_lift_m = t_move.z;
  const glm::dvec3 s_turn = spatial::vector_from_rotation(query.s.X_CO.R * glm::conjugate(X_CS_.R)),
                   t_turn = spatial::vector_from_rotation(query.t.X_CO.R * glm::conjugate(X_CT_.R));
  const auto across = [&](const glm::dvec3& move, const glm::dvec3& turn) {
    return glm::length(glm::dvec2{move} - place.shift_m) + std::abs(turn.z) * radius_m_;
  };
  const double across_m = across(s_move, s_turn) + across(t_move, t_turn),
               tilt_m = glm::length(glm::dvec2{s_turn - t_turn}) * radius_m_;
  const double least_way_m =
      std::min(search_.least_way_m,
               search_.is_at_edge ? std::min(search_.least_way_at_edge_m, kMostAcrossAtEdge_m) : kMostAcross_m);
  // A window that has grown shows what was not searched.
  const bool has_grown = glm::any(glm::lessThan(query.window.low + search_.step_m, window_.low)) ||
                         glm::any(glm::greaterThan(query.window.high - search_.step_m, window_.high));
  return across_m < least_way_m * (1 - tilt_m / search_.nearer_m) && !has_grown && triangles_ == mixed(query);
}

}  // namespace farfeel::penetration
