// A coarse triangle of T is divided until its parts are points. The distance to S's surface changes by no more than the
// way between two places, so a part's centre bounds it: what cannot come near the deepest point is dropped. What points
// turned out to be bounds their part better, and at later poses too, by the way that T has gone since.
#include "haptic_core/contact/depth/points/point_depth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/contact/depth/points/constants.h"
#include "haptic_core/contact/smooth_step.h"
#include "haptic_core/counting/work.h"
#include "haptic_core/penetration/back_end.h"
#include "haptic_core/penetration/simd/simd_kernels.h"

namespace farfeel::contact {
namespace {

using penetration::simd::kLeafPoints;
using penetration::simd::kLeastNearness;
using penetration::simd::kNearnessWithin_m;
using penetration::simd::kNotAbove;
using spatial::Pose;
namespace simd = penetration::simd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

float narrow(double x) {
  return static_cast<float>(x);
}

/// The facet for the kernels, which take what they know of it from its forms.
simd::FootFacet foot_facet(const FacetedSurface& s, std::uint32_t triangle) {
  const FacetedSurface::Facet& facet = s.facet(triangle);
  simd::FootFacet foot{};
  foot.relief = narrow(s.relief_m(triangle));
  const glm::dvec3 anchor = facet.corners_O[0];
  const auto set = [&](int row, const glm::dvec3& way, double at_anchor) {
    foot.at_anchor[row] = narrow(at_anchor);
    for (int k = 0; k < 3; ++k) foot.per[k][row] = narrow(way[k]);
  };
  set(simd::FootFacet::kAbove, facet.nhat_O, 0);
  for (int e = 0; e < 3; ++e) {
    const auto edge = static_cast<std::size_t>(e);
    const glm::dvec3 from = anchor - facet.corners_O[edge];
    set(simd::FootFacet::kInside + e, facet.inward_O[edge], glm::dot(from, facet.inward_O[edge]));
    set(simd::FootFacet::kAlong + e, facet.along_O[edge], glm::dot(from, facet.along_O[edge]));
    foot.length[e] = narrow(facet.length_m[edge]), foot.anchor_S[e] = anchor[e];
  }
  if (facet.chart == geometry::kNoChart) return foot;
  const geometry::HapticSurface& haptic = s.felt().haptic();
  const geometry::Chart& chart = haptic.charts[facet.chart];
  for (int k = 0; k < 3; ++k) {
    const double unit = k < 2 ? 1 / chart.texel_m : 1;
    const double offset = k < 2 ? 0 : haptic.scale.offset_m;
    set(simd::FootFacet::kChart + k, unit * facet.R_OH[k],
        unit * glm::dot(anchor - facet.p_OH, facet.R_OH[k]) - offset);
  }
  const penetration::PackedHeights packed = s.felt().packed(facet.chart);
  foot.heights = packed.heights;
  foot.stride = static_cast<std::int32_t>(packed.stride);
  foot.columns = static_cast<std::int32_t>(chart.columns);
  foot.rows = static_cast<std::int32_t>(chart.rows);
  foot.scale = narrow(haptic.scale.scale_m);
  return foot;
}

}  // namespace

/// Of weights area exp((depth - level) / w).
struct PointDepth::Sums {
  glm::dvec3 p_STo_S;
  double width_m, point_m2;                            ///< what a point stands for, on average
  double along = 0;                                    ///< how much a point of the triangle at hand counts
  double level_m = -kInfinity, lowest_m = -kInfinity;  ///< of the deepest; below the other a point is left out
  double weight = 0;
  glm::dvec3 turning{0}, moving{0}, point{0};

  void rise_to(double depth_m) {
    if (!(depth_m > level_m)) return;
    const double scale = weight > 0 ? std::exp((level_m - depth_m) / width_m) : 0;
    weight *= scale, turning *= scale, moving *= scale, point *= scale;
    level_m = depth_m;
  }
  void add(const simd::FeetSums& leaf, const glm::dvec3& centre_S) {
    if (!(leaf.weight > 0)) return;
    const glm::dvec3 leaf_moving{leaf.moving[0], leaf.moving[1], leaf.moving[2]};
    weight += leaf.weight;
    moving += leaf_moving;
    turning +=
        glm::cross(centre_S - p_STo_S, leaf_moving) + glm::dvec3{leaf.turning[0], leaf.turning[1], leaf.turning[2]};
    point += leaf.weight * centre_S + glm::dvec3{leaf.point[0], leaf.point[1], leaf.point[2]};
    lowest_m = level_m + width_m * (std::log(weight / point_m2) - kPointTailWidths);
  }
};

/// A triangle of T, or a part of it.
struct PointDepth::Part {
  std::array<glm::dvec3, 3> corners_S;
  std::uint32_t triangle, first, levels;  ///< the first of its points, and how often it can still be divided

  [[nodiscard]] bool is_leaf() const { return levels <= kLeafLevels; }
  [[nodiscard]] glm::dvec3 centre_S() const { return (corners_S[0] + corners_S[1] + corners_S[2]) / 3.0; }
};

PointDepth::PointDepth(const FacetedSurface& s, SurfacePoints& t, double tolerance_m, penetration::InstructionSet set)
    : s_(s),
      t_(t),
      tolerance_m_(tolerance_m),
      kernels_(penetration::simd_kernels(set)),
      nearest_(NearestFacets::shared(s,
                                     std::min(tolerance_m, kAbove_m) + s.most_relief_m() + t.surface().most_relief_m(),
                                     tolerance_m, kSiftedWay_m + t.usual_aside_m())),
      counts_(s.felt().haptic().piece_count, 0),
      leaf_first_(t.surface().size()),
      seen_(s.size(), 0),
      part_first_(t.surface().size()) {
  facets_.reserve(s.size());
  for (std::uint32_t i = 0; i < s.size(); ++i)
    facets_.push_back(foot_facet(s, i)), piece_of_.push_back(s.facet(i).piece);
  felt_.reserve(kMostLeaves + t.surface().size());
  whole_.reserve(t.surface().size());
  sifted_.reserve(simd::kMostSifted);
  std::uint32_t parts = 0, leaves = 0;
  for (std::uint32_t i = 0; i < part_first_.size(); ++i) {
    part_first_[i] = parts, leaf_first_[i] = leaves;
    const std::uint32_t of_triangle = std::max(t.count(i) / kLeafPoints, 1u);
    leaves += of_triangle, parts += of_triangle - 1;
  }
  leaves_.resize(leaves);
  bounds_.resize(parts);
  for (const glm::dvec3& corner : t.surface().felt().haptic().coarse.positions_O)
    arm_m_ = std::max(arm_m_, glm::length(corner));
  arm_m_ += t.surface().most_relief_m();
}

void PointDepth::go_to(const Pose& X_ST) noexcept {
  const bool is_as_high = is_known_ && s_changes_ == s_.felt().changes() && t_changes_ == t_.surface().felt().changes();
  is_known_ = true;
  if (pose_ > 0 && X_ST.p == X_ST_.p && X_ST.R == X_ST_.R && is_as_high) return;
  const double turn = glm::length(spatial::vector_from_rotation(X_ST.R * glm::conjugate(X_ST_.R)));
  turned_ += turn;
  way_m_ += is_as_high && !ablated(Mechanism::kPointBounds)
                ? kSteepestRelief * (glm::distance(X_ST.p, X_ST_.p) + turn * arm_m_)
                : kAnywhere_m;
  if (!is_as_high) {
    ++heights_;
    for (std::uint32_t i = 0; i < facets_.size(); ++i) facets_[i].relief = narrow(s_.relief_m(i));
  }
  X_ST_ = X_ST;
  R_ST_ = glm::mat3_cast(X_ST.R);
  s_changes_ = s_.felt().changes(), t_changes_ = t_.surface().felt().changes();
  felt_.clear();
  if (++pose_ > 0) return;
  for (Leaf& leaf : leaves_) leaf.pose = 0;  // numbers begin anew
  pose_ = 1;
}

DepthSource PointDepth::evaluate(const Cluster& cluster, const Pose& X_ST, double soft_width_m) noexcept {
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
      const double cosine = -glm::dot(R_ST_ * t_.surface().facet(triangle).nhat_O, cluster.nhat_ST_S),
                   along = share_between(cosine, kPointUnaligned, kPointAligned);
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

  DepthSource answer = DepthSource{};
  if (!(sums.weight > 0)) return answer;
  answer.depth_m = sums.level_m + soft_width_m * std::log(sums.weight / penetration::kReferenceArea_m2);
  answer.gradient = spatial::to_vector6(spatial::Wrench{sums.turning / sums.weight, sums.moving / sums.weight});
  answer.p_S = sums.point / sums.weight;
  return answer;
}

PointDepth::Bound& PointDepth::bound_at(const Part& part) noexcept {
  const std::uint32_t above = t_.levels(part.triangle) - part.levels,
                      first = part_first_[part.triangle] + (1u << above) - 1;
  return bounds_[first + ((part.first - t_.first(part.triangle)) >> part.levels)];
}

PointDepth::Leaf& PointDepth::leaf_at(const Part& part) noexcept {
  return leaves_[leaf_first_[part.triangle] + (part.first - t_.first(part.triangle)) / kLeafPoints];
}

/// How far any of its points has come since, at most.
double PointDepth::way_m(const Place& since, const Leaf& leaf, const glm::dvec3& centre_S) const noexcept {
  if (since.heights != heights_) return kInfinity;
  return glm::distance(centre_S, since.centre_S) + (turned_ - since.turned) * leaf.radius_m;
}

/// No point of the part is deeper.
double PointDepth::deepest_m(const Part& part) noexcept {
  if (part.is_leaf()) {
    const Leaf& leaf = leaf_at(part);
    return leaf.most_m + kSteepestRelief * way_m(leaf.felt, leaf, part.centre_S());
  }
  Bound& bound = bound_at(part);
  const double known_m = bound.deepest_m + (way_m_ - bound.way_m);
  // Leaves know better than that.
  if (way_m_ - bound.way_m < kAnew_m || part.levels <= kLeafLevels + 2) return known_m;
  bound = {way_m_, std::min(known_m, bound_of(part))};
  return bound.deepest_m;
}

double PointDepth::bound_of(const Part& part) const noexcept {
  const auto& [a, b, c] = part.corners_S;
  const glm::dvec3 centre_S = part.centre_S();
  const auto square_to = [&](const glm::dvec3& corner) { return glm::dot(corner - centre_S, corner - centre_S); };
  // T's relief brings points deeper as far as it rises; where it sinks, at most against what hardly faces it.
  const penetration::Relief& relief = t_.surface().felt().relief(part.triangle);
  const double own_m = std::sqrt(std::max({square_to(a), square_to(b), square_to(c)})) +
                       std::max({relief.high_m, -kNotAbove * relief.low_m, 0.0});
  const NearestFacets::Near near = nearest_->near(centre_S);
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
  const bool has_room = felt_.size() < kMostLeaves;
  if (part.is_leaf() || !has_room) return feel(part, sums);
  const double most_m = deepest_m(part);
  if (!(most_m > sums.lowest_m)) return most_m;
  const auto half = halves(part.corners_S);
  const std::uint32_t levels = part.levels - 1;
  double deepest_m = -kInfinity;
  for (std::uint32_t k = 0; k < 2; ++k) {
    deepest_m = std::max(deepest_m, look_into({half[k], part.triangle, part.first + (k << levels), levels}, sums));
  }
  if (felt_.size() < kMostLeaves) bound_at(part) = {way_m_, std::min(deepest_m, most_m)};
  return deepest_m;
}

/// A leaf, or of what is more its first.
double PointDepth::feel(const Part& part, Sums& sums) noexcept {
  Leaf& leaf = leaf_at(part);
  const bool is_felt = leaf.pose == pose_;
  if (!is_felt || sums.lowest_m < felt_[leaf.foot].lowest_m) {
    const glm::dvec3 centre_S = part.centre_S();
    if (leaf.felt.heights == heights_ && !ablated(Mechanism::kPointBounds)) {
      const double known_m = leaf.most_m + kSteepestRelief * way_m(leaf.felt, leaf, centre_S);
      if (!(known_m > sums.lowest_m)) return known_m;
    }
    if (!is_felt && felt_.size() == felt_.capacity()) return kInfinity;
    const std::uint32_t at = part.first - t_.first(part.triangle);
    const auto points =
        t_.of(part.triangle).subspan(at, std::min<std::size_t>(t_.count(part.triangle) - at, kLeafPoints));
    points_ += static_cast<std::uint32_t>(points.size());
    counting::count(Work::kPoints, points.size());
    const glm::dvec3 nhat_S = R_ST_ * t_.surface().facet(part.triangle).nhat_O, from_centre_S = X_ST_.p - centre_S;
    simd::FeetTask task{};
    task.points_T = &points[0].x;
    task.count = static_cast<std::int32_t>(points.size());
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < 3; ++i) task.R_ST[k][i] = R_ST_[i][k];
      task.from_centre[k] = from_centre_S[k], task.centre_S[k] = centre_S[k], task.nhat_S[k] = narrow(nhat_S[k]);
    }
    task.facets = facets_.data();
    task.tolerance = narrow(tolerance_m_);
    task.lowest = narrow(std::max(sums.lowest_m, double{simd::kNowhere}));
    if (!(way_m(leaf.sifted, leaf, centre_S) < kSiftedWay_m) || turned_ - leaf.sifted.turned > kSiftedTurn ||
        ablated(Mechanism::kSiftedLeaves))
      sift(leaf, task);
    task.is_far = leaf.is_far;
    task.near = leaf.facets.data();
    task.near_count = static_cast<std::int32_t>(leaf.count);
    if (!is_felt) {
      leaf.pose = pose_;
      leaf.foot = static_cast<std::uint32_t>(felt_.size());
      felt_.emplace_back();
    }
    Felt& felt = felt_[leaf.foot];
    const simd::FeetSeen seen = kernels_.feel(task, felt.feet);
    felt.centre_S = centre_S;
    felt.deepest_m = seen.deepest;
    felt.lowest_m = seen.is_all ? narrow(-kInfinity) : task.lowest;
    leaf.most_m = std::max(seen.most < simd::kEndlessWay ? double{seen.most} : kInfinity, leaf.far_m);
    leaf.felt = here(centre_S);
  }
  add(part, leaf, sums);
  return part.is_leaf() ? leaf.most_m : kInfinity;
}

/// Finds the facets that the leaf can be felt against for a while.
void PointDepth::sift(Leaf& leaf, const simd::FeetTask& task) noexcept {
  leaf.radius_m = 0, leaf.far_m = -kInfinity;
  leaf.is_far = 0;
  sifted_.clear();
  if (++sifting_ == 0) std::fill(seen_.begin(), seen_.end(), 0), sifting_ = 1;
  const glm::dvec3 centre_S{task.centre_S[0], task.centre_S[1], task.centre_S[2]};
  const std::uint32_t* last = nullptr;
  std::array<glm::dvec3, kLeafPoints> p_S;
  double square = 0;
  for (int i = 0; i < task.count; ++i) {
    const double* const p = task.points_T + 3 * i;
    p_S[static_cast<std::size_t>(i)] = X_ST_.p + R_ST_ * glm::dvec3{p[0], p[1], p[2]};
    const glm::dvec3 away = p_S[static_cast<std::size_t>(i)] - centre_S;
    square = std::max(square, glm::dot(away, away));
  }
  leaf.radius_m = std::sqrt(square);
  // The place amid four parts asks for all of them.
  int step = std::min(task.count, 4);
  const auto amid = [&](int i) {
    glm::dvec3 sum{0};
    for (int k = i; k < i + step; ++k) sum += p_S[static_cast<std::size_t>(k)];
    return sum / static_cast<double>(step);
  };
  const auto is_aside = [&](int i) {
    return glm::distance(p_S[static_cast<std::size_t>(i)], amid(i - i % step)) > t_.usual_aside_m();
  };
  for (int i = 0; i < task.count; ++i)
    if (is_aside(i)) step = 1;
  for (int i = 0; i < task.count; i += step) {
    const NearestFacets::Near near = nearest_->near(amid(i));
    if (near.facets.empty()) {
      leaf.is_far |= ((1u << step) - 1) << i;
      leaf.far_m = std::max(leaf.far_m, near.is_beneath ? kInfinity : -near.least_m);
    } else if (near.facets.data() != last) {
      last = near.facets.data();
      for (const std::uint32_t facet : near.facets) {
        if (seen_[facet] == sifting_ || sifted_.size() == sifted_.capacity()) continue;
        seen_[facet] = sifting_;
        sifted_.push_back(facet);
      }
    }
  }
  simd::FeetTask all = task;
  all.near = sifted_.data();
  all.near_count = static_cast<std::int32_t>(sifted_.size());
  leaf.count = static_cast<std::uint32_t>(
      kernels_.sift_facets(all, {narrow(kSiftedWay_m), narrow(kSiftedTurn)}, leaf.facets.data()));
  leaf.sifted = here(centre_S);
}

void PointDepth::add(const Part& part, const Leaf& leaf, Sums& sums) noexcept {
  const Felt& felt = felt_[leaf.foot];
  if (!(felt.deepest_m > sums.lowest_m) || !(felt.deepest_m > simd::kNowhere)) return;
  std::array<float, simd::kMostLeafFacets> counts;
  bool do_all = true;
  for (std::uint32_t k = 0; k < leaf.count; ++k) {
    const bool does = counts_[piece_of_[leaf.facets[k]]] != 0;
    counts[k] = does ? 1 : 0, do_all = do_all && does;
  }
  double deepest_m = felt.deepest_m;
  const std::uint32_t points = std::min(t_.count(part.triangle), std::uint32_t{kLeafPoints});
  if (!do_all) {
    deepest_m = simd::kNowhere;
    for (std::uint32_t i = 0; i < points; ++i) {
      if (felt.feet.share[i] > 0 && counts[static_cast<std::uint32_t>(felt.feet.which[i])] > 0)
        deepest_m = std::max(deepest_m, double{felt.feet.depth[i]});
    }
    if (!(deepest_m > sums.lowest_m)) return;
  }
  sums.rise_to(deepest_m);
  const double parts = static_cast<double>(1u << (t_.levels(part.triangle) - part.levels)),
               area_m2 = t_.surface().facet(part.triangle).area_m2 / parts;
  simd::FeetSums leaf_sums{};
  kernels_.add_feet({.feet = &felt.feet,
                     .counts = do_all ? nullptr : counts.data(),
                     .weight = narrow(sums.along * area_m2 / points),
                     .level = narrow(sums.level_m),
                     .lowest = narrow(std::max(sums.lowest_m, double{simd::kNowhere})),
                     .width = narrow(sums.width_m)},
                    leaf_sums);
  sums.add(leaf_sums, felt.centre_S);
}

}  // namespace farfeel::contact
