// A coarse triangle of T is divided until its parts are points. The distance to S's surface changes by no more than the
// way between two places, so a part's centre bounds it: what cannot come near the deepest point is dropped. What points
// turned out to be bounds their part better, and at later poses too, by the way that T has gone since.
#include "haptic_core/contact/point_depth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::contact {
namespace {

using spatial::Pose;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A point that weighs less than exp(-12) = 6e-6 of all together is left out.
constexpr double kTailWidths = 12;
/// Cosine between the way against T's normal at a point and the cluster's direction: what leads the other way is
/// another contact's. S's normal would do as well, but changes as points pass from facet to facet.
constexpr double kNoneBelow = 0.05, kFullAbove = 0.35;
/// Cosine between the normals of T and S: what looks the same way does not touch. A square edge, and a needle's flank,
/// still do.
constexpr double kFacesBelow = 0.05, kNotAbove = 0.4;
/// What faces a point may be farther than what does not, as a share of the depth: until it is not what the point
/// pressed through. Depths are not told apart by less than the last.
constexpr double kLeastNearness = 0.35, kFullNearness = 0.7, kNearnessWithin_m = 20e-6;
/// From pose to pose a depth changes by no more than the way times this, where S's relief is no steeper than 37
/// degrees.
constexpr double kSteepest = 1.25;
/// After so much of a way a part is bounded anew. And a way after which nothing is known.
constexpr double kAnew_m = 0.15e-3, kAnywhere_m = 1e3;
/// Points that are farther above S than this push nobody, nor will they soon.
constexpr double kAbove_m = 1e-3;

/// A triangle that may be the nearest.
struct Near {
  double above_m, square_m2;
  std::uint32_t facet;
  bool is_square, faces;  ///< whether the point stands square over or under it; whether it faces the point's own
};
constexpr std::size_t kMostNear = 24;  ///< more are left out

double smooth_step(double x) {
  return x * x * (3 - 2 * x);
}
double smooth_step_slope(double x) {
  return 6 * x * (1 - x);
}
/// Of its logarithm.
double smooth_step_ln_slope(double x) {
  return 6 * (1 - x) / (x * (3 - 2 * x));
}

double counts_along(double cosine) {
  return smooth_step(std::clamp((cosine - kNoneBelow) / (kFullAbove - kNoneBelow), 0.0, 1.0));
}

/// How deep p is under one triangle's felt surface; where it is beside the triangle, under or over its edge. sign: 1 on
/// the inner side of the coarse surface, -1 on the outer.
FeltHeight under(const FacetedSurface& s, const FacetedSurface::Facet& facet, const glm::dvec3& p_S, double sign,
                 bool is_square) noexcept {
  const FeltHeight height = felt_height(s.felt(), facet, p_S);
  if (is_square) return height;
  glm::dvec3 beside_S;
  const double beside_m = facet.distance(p_S, beside_S).beside_m;
  if (!(sign * height.deep_m > 0)) return {height.deep_m + sign * beside_m, height.slope_O + sign * beside_S};
  const double away_m = std::sqrt(height.deep_m * height.deep_m + beside_m * beside_m);
  return {sign * away_m, (std::abs(height.deep_m) * height.slope_O + sign * beside_m * beside_S) / away_m};
}

}  // namespace

// The coarse surface says on which side of it p is: its nearest triangle does, since it is closed. On the inner side
// the least of the depths beneath triangles that have p beneath them counts, on the outer side the greatest: relief can
// make neighbours of the nearest the nearest, but not triangles that p is on the other side of. All this once among the
// triangles that face p, and on the inner side once among all.
PointFoot foot_of(const FacetedSurface& s, std::span<const std::uint32_t> facets, const glm::dvec3& p_S,
                  const glm::dvec3& nhat_S, double tolerance_m, double lowest_m) noexcept {
  PointFoot foot;
  foot.p_S = p_S;
  std::array<Near, kMostNear> near;
  std::size_t count = 0;
  struct Nearest {
    double square = kInfinity, above_m = 0;
    std::uint32_t facet = 0;
    double limit = kInfinity;  ///< square of how high over a triangle what it might be it still stands
  } of_all, facing;
  const double relief_m = 2 * s.most_relief_m();
  const auto note = [&](Nearest& nearest, double square, double above_m, std::uint32_t facet) {
    if (!(square < nearest.square)) return;
    const double limit_m = (1 + kPrefersSquare) * std::sqrt(square) + relief_m;
    nearest = {square, above_m, facet, limit_m * limit_m};
  };
  for (const std::uint32_t i : facets) {
    const FacetedSurface::Plane& plane = s.plane(i);
    const double above_m = plane.above_m(p_S);
    if (above_m * above_m > facing.limit) continue;
    const bool faces = glm::dot(plane.nhat_O, nhat_S) < kNotAbove;
    if (!faces && above_m * above_m > of_all.limit) continue;
    const FlatDistance at = s.facet(i).distance(p_S);
    const double square = at.square_m2() - kPrefersSquare * above_m * above_m;
    note(of_all, square, above_m, i);
    if (faces) note(facing, square, above_m, i);
    if (count == near.size()) {  // what is out by now makes room
      const auto end = std::remove_if(near.begin(), near.end(), [&](const Near& one) {
        return one.square_m2 > of_all.limit && !(one.faces && one.square_m2 <= facing.limit);
      });
      count = static_cast<std::size_t>(end - near.begin());
    }
    if (count < near.size()) near[count++] = {above_m, at.square_m2(), i, at.beside_m == 0, faces};
  }
  const double sign = of_all.above_m < 0 ? 1 : -1;  // of what is deeper
  if (!facets.empty() && sign < 0) foot.most_m = s.most_above_m() - std::sqrt(of_all.square);
  if (!(facing.square < tolerance_m * tolerance_m)) return foot;
  const auto best_of = [&](const Nearest& nearest, bool only_facing, std::uint32_t& which) {
    FeltHeight best{sign * kInfinity, {}};
    for (std::size_t k = 0; k < count; ++k) {
      const Near& one = near[k];
      if ((only_facing && !one.faces) || one.above_m * sign > 0 || one.square_m2 > nearest.limit) continue;
      const FeltHeight height = under(s, s.facet(one.facet), p_S, sign, one.is_square);
      if (sign * height.deep_m < sign * best.deep_m) best = height, which = one.facet;
    }
    return best;
  };
  const double facing_m = std::sqrt(facing.square),
               deepest_m = s.most_above_m() + (sign > 0 ? (1 + kPrefersSquare) * facing_m : -facing_m);
  if (deepest_m <= lowest_m) {
    foot.is_bounded_only = true;
    // What does not face p may become what it presses through, as deep as it is near.
    foot.most_m = sign > 0 || of_all.facet == facing.facet ? deepest_m : std::min(foot.most_m, lowest_m);
    return foot;
  }
  // On the outer side what faces p across a valley is farther and so pushes less: nothing else need be known.
  if (sign < 0 && !(facing.above_m > 0)) return foot;
  const FeltHeight near_facing = best_of(facing, true, foot.facet);
  if (!std::isfinite(near_facing.deep_m)) return foot;
  foot.depth_m = near_facing.deep_m, foot.slope_S = near_facing.slope_O;
  foot.most_m =
      of_all.facet == facing.facet || sign > 0 ? near_facing.deep_m : std::max(near_facing.deep_m, foot.most_m);
  const glm::dvec3& nhat_facet_S = s.facet(foot.facet).nhat_O;
  const double x = (kNotAbove - glm::dot(nhat_facet_S, nhat_S)) / (kNotAbove - kFacesBelow);
  foot.share = 1;
  if (x < 1) {
    foot.share = smooth_step(x);
    foot.ln_share_by_rotation_S =
        -smooth_step_ln_slope(x) / (kNotAbove - kFacesBelow) * glm::cross(nhat_S, nhat_facet_S);
  }
  if (sign < 0 || of_all.facet == facing.facet) return foot;
  std::uint32_t other = 0;
  const FeltHeight near_any = best_of(of_all, false, other);
  const double most_m = std::max(near_facing.deep_m, 0.0) + kNearnessWithin_m,
               nearness = (std::max(near_any.deep_m, 0.0) + kNearnessWithin_m) / most_m,
               y = std::clamp((nearness - kLeastNearness) / (kFullNearness - kLeastNearness), 0.0, 1.0);
  if (y >= 1 || !(near_facing.deep_m > 0)) return foot;
  if (!(y > 0)) foot.share = 0;
  foot.depth_m = smooth_step(y) * near_facing.deep_m;
  foot.slope_S = smooth_step(y) * near_facing.slope_O + smooth_step_slope(y) * near_facing.deep_m /
                                                            ((kFullNearness - kLeastNearness) * most_m) *
                                                            (near_any.slope_O - nearness * near_facing.slope_O);
  return foot;
}

/// Of weights area exp((depth - level) / w).
struct PointDepth::Sums {
  glm::dvec3 p_STo_S;
  double width_m, point_m2;                            ///< what a point stands for, on average
  double along = 0;                                    ///< how much a point of the triangle at hand counts
  double level_m = -kInfinity, lowest_m = -kInfinity;  ///< of the deepest; below the other a point is left out
  double weight = 0;
  std::uint32_t added = 0;
  glm::dvec3 turning{0}, moving{0}, point{0};

  void add(const PointFoot& foot, double area_m2) {
    if (foot.depth_m > level_m) {
      const double scale = weight > 0 ? std::exp((level_m - foot.depth_m) / width_m) : 0;
      weight *= scale, turning *= scale, moving *= scale, point *= scale;
      level_m = foot.depth_m;
    }
    const double w = area_m2 * foot.share * std::exp((foot.depth_m - level_m) / width_m);
    weight += w;
    turning += w * (glm::cross(foot.p_S - p_STo_S, foot.slope_S) + width_m * foot.ln_share_by_rotation_S);
    moving += w * foot.slope_S;
    point += w * foot.p_S;
    constexpr std::uint32_t kEvery = 8;  // it only rises, and what is left in does no harm
    if (added++ % kEvery == 0) lowest_m = level_m + width_m * (std::log(weight / point_m2) - kTailWidths);
  }
};

/// A triangle of T, or a part of it.
struct PointDepth::Part {
  std::array<glm::dvec3, 3> corners_S;
  std::uint32_t triangle, first, levels;  ///< the first of its points, and how often it can still be divided
};

PointDepth::PointDepth(const FacetedSurface& s, SurfacePoints& t, double tolerance_m)
    : s_(s),
      t_(t),
      tolerance_m_(tolerance_m),
      nearest_(s, std::min(tolerance_m, kAbove_m) + s.most_relief_m() + t.surface().most_relief_m(), tolerance_m),
      counts_(s.felt().haptic().piece_count, 0),
      found_(t.size()),
      part_first_(t.surface().size()) {
  feet_.reserve(kMostFeet + t.surface().size());
  whole_.reserve(t.surface().size());
  std::uint32_t parts = 0;
  for (std::uint32_t i = 0; i < part_first_.size(); ++i) part_first_[i] = parts, parts += (t.count(i) - 1) / 3;
  bounds_.resize(parts);
  for (const glm::dvec3& corner : t.surface().felt().haptic().coarse.positions_O)
    arm_m_ = std::max(arm_m_, glm::length(corner));
  arm_m_ += t.surface().most_relief_m();
}

void PointDepth::go_to(const Pose& X_ST) noexcept {
  const bool is_there = pose_ > 0 && X_ST.p == X_ST_.p && X_ST.R == X_ST_.R && s_changes_ == s_.felt().changes() &&
                        t_changes_ == t_.surface().felt().changes();
  if (is_there) return;
  const bool is_as_high = s_changes_ == s_.felt().changes() && t_changes_ == t_.surface().felt().changes();
  const double turn = glm::length(spatial::vector_from_rotation(X_ST.R * glm::conjugate(X_ST_.R)));
  way_m_ += is_as_high ? kSteepest * (glm::distance(X_ST.p, X_ST_.p) + turn * arm_m_) : kAnywhere_m;
  X_ST_ = X_ST;
  R_ST_ = glm::mat3_cast(X_ST.R);
  s_changes_ = s_.felt().changes(), t_changes_ = t_.surface().felt().changes();
  feet_.clear();
  if (++pose_ > 0) return;
  for (Found& found : found_) found.pose = 0;  // numbers begin anew
  pose_ = 1;
}

CoarseDepth PointDepth::evaluate(const Cluster& cluster, const Pose& X_ST, double soft_width_m) noexcept {
  points_ = 0;
  go_to(X_ST);
  const auto pieces_s = cluster.pieces_s.view(), pieces_t = cluster.pieces_t.view();
  for (const std::uint32_t piece : pieces_s) counts_[piece] = 1;
  Sums sums{.p_STo_S = X_ST.p, .width_m = soft_width_m, .point_m2 = t_.mean_area_m2()};
  const auto corners_S = [&](std::uint32_t triangle) {
    std::array<glm::dvec3, 3> corners = t_.surface().facet(triangle).corners_O;
    for (glm::dvec3& corner : corners) corner = X_ST_.p + R_ST_ * corner;
    return corners;
  };
  whole_.clear();
  for (const std::uint32_t piece : pieces_t) {
    for (const std::uint32_t triangle : t_.surface().felt().triangles_of_piece(piece)) {
      const double along = counts_along(-glm::dot(R_ST_ * t_.surface().facet(triangle).nhat_O, cluster.nhat_ST_S));
      if (!(along > 0)) continue;
      const double deepest = deepest_m({corners_S(triangle), triangle, t_.first(triangle), t_.levels(triangle)});
      if (deepest > -tolerance_m_) whole_.push_back({triangle, along, deepest});
    }
  }
  std::sort(whole_.begin(), whole_.end(), [](const Whole& a, const Whole& b) { return a.deepest_m > b.deepest_m; });
  for (const Whole& whole : whole_) {
    if (!(whole.deepest_m > sums.lowest_m)) break;
    sums.along = whole.along;
    static_cast<void>(look_into(
        {corners_S(whole.triangle), whole.triangle, t_.first(whole.triangle), t_.levels(whole.triangle)}, sums));
  }
  for (const std::uint32_t piece : pieces_s) counts_[piece] = 0;

  CoarseDepth answer = CoarseDepth::none();
  if (!(sums.weight > 0)) return answer;
  answer.depth_m = sums.level_m + soft_width_m * std::log(sums.weight / penetration::kReferenceArea_m2);
  answer.gradient = spatial::to_vector6(spatial::Wrench{sums.turning / sums.weight, sums.moving / sums.weight});
  answer.p_S = sums.point / sums.weight;
  return answer;
}

PointDepth::Bound& PointDepth::bound_at(const Part& part) noexcept {
  const std::uint32_t above = t_.levels(part.triangle) - part.levels,
                      first = part_first_[part.triangle] + ((1u << 2 * above) - 1) / 3;
  return bounds_[first + ((part.first - t_.first(part.triangle)) >> 2 * part.levels)];
}

/// No point of the part is deeper.
double PointDepth::deepest_m(const Part& part) noexcept {
  if (part.levels == 0) return kInfinity;
  Bound& bound = bound_at(part);
  const double known_m = bound.deepest_m + (way_m_ - bound.way_m);
  if (way_m_ - bound.way_m < kAnew_m) return known_m;
  bound = {way_m_, std::min(known_m, bound_of(part))};
  return bound.deepest_m;
}

double PointDepth::bound_of(const Part& part) const noexcept {
  const auto& [a, b, c] = part.corners_S;
  const glm::dvec3 centre_S = (a + b + c) / 3.0;
  const auto square_to = [&](const glm::dvec3& corner) { return glm::dot(corner - centre_S, corner - centre_S); };
  // T's relief brings points deeper as far as it rises; where it sinks, at most against what hardly faces it.
  const penetration::Relief& relief = t_.surface().felt().relief(part.triangle);
  const double own_m = std::sqrt(std::max({square_to(a), square_to(b), square_to(c)})) +
                       std::max({relief.high_m, -kNotAbove * relief.low_m, 0.0});
  const NearestFacets::Near near = nearest_.near(centre_S);
  if (near.facets.empty()) {
    return near.is_beneath ? kInfinity : own_m + s_.most_above_m() - near.least_m;
  }
  double nearest = kInfinity, told = kInfinity, above_m = 0;
  for (const std::uint32_t i : near.facets) {
    const FlatDistance at = s_.facet(i).distance(centre_S);
    const double square = at.square_m2(), one = square - kPrefersSquare * at.above_m * at.above_m;
    nearest = std::min(nearest, square);
    if (one < told) told = one, above_m = at.above_m;
  }
  nearest = std::sqrt(nearest);
  const double slack_m = own_m + s_.most_above_m();
  // Beneath, what faces a point may be farther than the nearest place.
  return above_m > 0 ? slack_m - nearest : (nearest + slack_m) / kLeastNearness + kNearnessWithin_m;
}

/// Adds what the points of a part of T weigh. Returns what none of them is deeper than.
double PointDepth::look_into(const Part& part, Sums& sums) noexcept {
  if (part.levels == 0 || feet_.size() >= kMostFeet) return feel(part, sums);
  const double most_m = deepest_m(part);
  if (!(most_m > sums.lowest_m)) return most_m;
  const auto quarter = quarters(part.corners_S);
  const std::uint32_t levels = part.levels - 1;
  double deepest_m = -kInfinity;
  for (std::uint32_t k = 0; k < 4; ++k) {
    deepest_m =
        std::max(deepest_m, look_into({quarter[k], part.triangle, part.first + (k << 2 * levels), levels}, sums));
  }
  if (feet_.size() < kMostFeet) bound_at(part) = {way_m_, std::min(deepest_m, most_m)};
  return deepest_m;
}

/// The part as one point of T's displaced surface: its first.
double PointDepth::feel(const Part& part, Sums& sums) noexcept {
  Found& found = found_[part.first];
  const FacetedSurface::Facet& tool = t_.surface().facet(part.triangle);
  if (found.pose != pose_) {
    const double known_m = found.most_m + (way_m_ - found.way_m);
    if (!(known_m > sums.lowest_m)) return known_m;
    if (feet_.size() == feet_.capacity()) return kInfinity;
    ++points_;
    const glm::dvec3 p_S = X_ST_.p + R_ST_ * t_.of(part.triangle)[part.first - t_.first(part.triangle)];
    const NearestFacets::Near near = nearest_.near(p_S);
    const PointFoot foot = foot_of(s_, near.facets, p_S, R_ST_ * tool.nhat_O, tolerance_m_, sums.lowest_m);
    if (foot.is_bounded_only) {
      found = {way_m_, foot.most_m, 0, 0, 0};
      return std::max(foot.most_m, -std::numeric_limits<double>::max());
    }
    const bool is_far = near.facets.empty() && !near.is_beneath;
    found = {way_m_, is_far ? -near.least_m : foot.most_m, foot.share > 0 ? foot.depth_m : -kInfinity, pose_,
             static_cast<std::uint32_t>(feet_.size())};
    if (foot.share > 0) feet_.push_back(foot);
  }
  if (found.depth_m > sums.lowest_m) add(part, feet_[found.foot], sums);
  return found.most_m;
}

void PointDepth::add(const Part& part, const PointFoot& foot, Sums& sums) const noexcept {
  if (counts_[s_.facet(foot.facet).piece] == 0) return;
  const FacetedSurface::Facet& tool = t_.surface().facet(part.triangle);
  const auto points = static_cast<double>(1u << 2 * (t_.levels(part.triangle) - part.levels));
  sums.add(foot, sums.along * tool.area_m2 / points);
}

}  // namespace farfeel::contact
