// A coarse triangle of T is divided until its parts are small enough to be points. The distance to S's surface changes
// by no more than the way between two places, so a part's centre bounds it: what cannot come near the deepest point is
// dropped, and so are the triangles of S that cannot be the nearest any more.
#include "haptic_core/contact/point_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::contact {
namespace {

using penetration::FeltSurface;
using spatial::Pose;

/// Longest side of what counts as a point: as short as this, while the cluster's pieces hold no more points than that.
/// It depends on the pieces alone, so that points stay where they are on T.
constexpr double kLeastPoint_m = 0.1e-3, kMostPoints = 3'000;
constexpr double kTailWidths = 9;  ///< points further below the deepest weigh about 1e-4 in all
/// Cosine between S's normal at a point and the cluster's direction: what leads the other way is another contact's.
constexpr double kNoneBelow = 0.05, kFullAbove = 0.35;
/// Where two triangles meet in a valley their edge is as far as either: the one below the point is the nearer.
constexpr double kPrefersBelow = 1e-3;
/// Deep inside a tooth both its flanks are near: the one that faces the point's own is what it pressed through. One
/// that faces the same way is as much farther.
constexpr double kPrefersFacing = 1;
constexpr std::uint32_t kNone = 0xFFFF'FFFF;

/// How far p is above the facet's plane, and beside its triangle.
double above_m(const FacetedSurface::Facet& facet, const glm::dvec3& p) {
  return glm::dot(p - facet.corners_O[0], facet.nhat_O);
}

double beside_m(const FacetedSurface::Facet& facet, const glm::dvec3& p) {
  double least_square = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 from = p - facet.corners_O[k];
    const double inside_m = glm::dot(from, facet.inward_O[k]);
    if (inside_m >= 0) continue;
    const double along_m = glm::dot(from, facet.along_O[k]),
                 past_m = along_m - std::clamp(along_m, 0.0, facet.length_m[k]);
    least_square = std::min(least_square, inside_m * inside_m + past_m * past_m);
  }
  return least_square < std::numeric_limits<double>::infinity() ? std::sqrt(least_square) : 0;
}

double counts_along(double cosine) {
  const double x = std::clamp((cosine - kNoneBelow) / (kFullAbove - kNoneBelow), 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

}  // namespace

FacetedSurface::FacetedSurface(const FeltSurface& felt) : felt_(&felt) {
  const geometry::HapticSurface& surface = felt.haptic();
  facets_.reserve(surface.coarse.triangles.size());
  for (std::uint32_t i = 0; i < surface.coarse.triangles.size(); ++i) {
    Facet facet;
    for (std::size_t k = 0; k < 3; ++k) {
      facet.corners_O[k] = surface.coarse.positions_O[surface.coarse.triangles[i][k]];
    }
    facet.nhat_O = felt.unit_normal_O(i);
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 along = facet.corners_O[(k + 1) % 3] - facet.corners_O[k];
      const double length_m = glm::length(along);
      facet.length_m[k] = length_m;
      facet.along_O[k] = length_m > 0 ? along / length_m : glm::dvec3{0};
      facet.inward_O[k] = glm::cross(facet.nhat_O, facet.along_O[k]);
    }
    const auto& [a, b, c] = facet.corners_O;
    facet.centre_O = (a + b + c) / 3.0;
    facet.reach_m = std::max(
        {glm::distance(a, facet.centre_O), glm::distance(b, facet.centre_O), glm::distance(c, facet.centre_O)});
    facet.area_m2 = 0.5 * glm::length(glm::cross(b - a, c - a));
    facet.piece = surface.triangle_piece[i];
    facet.chart = surface.triangle_chart[i];
    facet.R_OH = glm::dmat3{1};
    facet.p_OH = glm::dvec3{0};
    if (facet.chart != geometry::kNoChart) {
      facet.R_OH = glm::mat3_cast(surface.charts[facet.chart].X_OH.R);
      facet.p_OH = surface.charts[facet.chart].X_OH.p;
    }
    facets_.push_back(facet);
    most_relief_m_ = std::max({most_relief_m_, -felt.relief(i).low_m, felt.relief(i).high_m});
  }
}

/// Of weights area exp((depth - level) / w).
struct PointDepth::Sums {
  glm::dvec3 nhat_ST_S, p_STo_S;
  Pose X_ST;
  double width_m;
  double level_m = -std::numeric_limits<double>::infinity();
  double weight = 0;
  glm::dvec3 turning{0}, moving{0}, point{0};

  void add(double depth_m, double area_m2, const glm::dvec3& p_S, const glm::dvec3& slope_S) {
    if (depth_m > level_m) {
      const double scale = weight > 0 ? std::exp((level_m - depth_m) / width_m) : 0;
      weight *= scale, turning *= scale, moving *= scale, point *= scale;
      level_m = depth_m;
    }
    const double w = area_m2 * std::exp((depth_m - level_m) / width_m);
    weight += w;
    turning += w * glm::cross(p_S - p_STo_S, slope_S);
    moving += w * slope_S;
    point += w * p_S;
  }
};

PointDepth::PointDepth(const FacetedSurface& s, const FacetedSurface& t, double tolerance_m)
    : s_(s),
      t_(t),
      tolerance_m_(tolerance_m),
      slot_of_t_(t.felt().haptic().piece_count, kNone),
      counts_(s.felt().haptic().piece_count, 0) {
  candidates_.reserve(kMostCandidates);
  distances_m_.resize(kMostCandidates);
  whole_.reserve(t.felt().haptic().coarse.triangles.size());
  cells_.reserve(4 * kMostLevels);
}

/// Of each of the cluster's pieces of T, all pieces of S that are near it, whether they are the cluster's or not.
void PointDepth::list_pieces_near(const Cluster& cluster, std::span<const collision::ProximityPair> pairs) noexcept {
  const auto pieces_t = cluster.pieces_t.view();
  for (std::uint32_t k = 0; k < pieces_t.size(); ++k) slot_of_t_[pieces_t[k]] = k, near_count_[k] = 0;
  for (const collision::ProximityPair& pair : pairs) {
    const std::uint32_t slot = slot_of_t_[pair.piece_t];
    if (slot != kNone && near_count_[slot] < kMostPieces) near_[slot][near_count_[slot]++] = pair.piece_s;
  }
  for (const std::uint32_t piece : pieces_t) slot_of_t_[piece] = kNone;
}

CoarseDepth PointDepth::evaluate(const Cluster& cluster, std::span<const collision::ProximityPair> pairs,
                                 const Pose& X_ST, double soft_width_m) noexcept {
  points_ = 0;
  const auto pieces_s = cluster.pieces_s.view(), pieces_t = cluster.pieces_t.view();
  for (const std::uint32_t piece : pieces_s) counts_[piece] = 1;
  list_pieces_near(cluster, pairs);
  Sums sums{.nhat_ST_S = cluster.nhat_ST_S, .p_STo_S = X_ST.p, .X_ST = X_ST, .width_m = soft_width_m};
  whole_.clear();
  candidates_.clear();
  double area_m2 = 0;
  for (std::uint32_t k = 0; k < pieces_t.size(); ++k) {
    for (const std::uint32_t triangle : t_.felt().triangles_of_piece(pieces_t[k])) {
      const FacetedSurface::Facet& tool = t_.facet(triangle);
      area_m2 += tool.area_m2;
      const glm::dvec3 centre_S = spatial::transform_point(X_ST, tool.centre_O);
      const auto first = static_cast<std::uint32_t>(candidates_.size());
      for (std::uint32_t n = 0; n < near_count_[k]; ++n) {
        for (const std::uint32_t candidate : s_.felt().triangles_of_piece(near_[k][n])) {
          const FacetedSurface::Facet& facet = s_.facet(candidate);
          const glm::dvec3 apart = facet.centre_O - centre_S;
          const double most_m = facet.reach_m + tool.reach_m + tolerance_m_;
          if (glm::dot(apart, apart) > most_m * most_m || candidates_.size() == kMostCandidates) continue;
          candidates_.push_back(candidate);
        }
      }
      const auto count = static_cast<std::uint32_t>(candidates_.size()) - first;
      if (count == 0) continue;
      Cell cell{.corners_T = tool.corners_O,
                .corners_S = {},
                .triangle = triangle,
                .first = first,
                .count = count,
                .level = 0,
                .deepest_m = 0};
      for (std::size_t c = 0; c < 3; ++c) cell.corners_S[c] = spatial::transform_point(X_ST, tool.corners_O[c]);
      if (!narrow(cell, -std::numeric_limits<double>::infinity())) continue;
      std::copy(candidates_.begin() + cell.first, candidates_.end(), candidates_.begin() + first);
      candidates_.resize(first + cell.count);
      cell.first = first;
      whole_.push_back(cell);
    }
  }
  std::sort(whole_.begin(), whole_.end(), [](const Cell& a, const Cell& b) { return a.deepest_m > b.deepest_m; });
  const double point_m = std::max(kLeastPoint_m, std::sqrt(4 * area_m2 / kMostPoints));
  for (const Cell& cell : whole_) look_into(cell, point_m, sums);
  for (const std::uint32_t piece : pieces_s) counts_[piece] = 0;

  CoarseDepth answer{-std::numeric_limits<double>::infinity(), spatial::Vector6::Zero(), glm::dvec3{0}};
  if (!(sums.weight > 0)) return answer;
  answer.depth_m = sums.level_m + soft_width_m * std::log(sums.weight / penetration::kReferenceArea_m2);
  answer.gradient = spatial::to_vector6(spatial::Wrench{sums.turning / sums.weight, sums.moving / sums.weight});
  answer.p_S = sums.point / sums.weight;
  return answer;
}

/// Puts those of the cell's candidates that may be nearest to some point of it on the stack, and bounds its depth.
/// False where it has none, or lies below lowest_m. The signed distance to S changes by no more than the way.
bool PointDepth::narrow(Cell& cell, double lowest_m) noexcept {
  const auto& [a, b, c] = cell.corners_S;
  const glm::dvec3 centre = (a + b + c) / 3.0;
  const auto square_of = [](const glm::dvec3& v) { return glm::dot(v, v); };
  const double reach_m = std::sqrt(std::max({square_of(a - centre), square_of(b - centre), square_of(c - centre)}));
  const penetration::Relief& own = t_.felt().relief(cell.triangle);
  const double slack_m = reach_m + std::max(-own.low_m, own.high_m) + s_.most_relief_m();
  double least_square = std::numeric_limits<double>::infinity(), nearest_m = least_square, nearest_above_m = 0;
  for (std::uint32_t k = 0; k < cell.count; ++k) {
    const FacetedSurface::Facet& facet = s_.facet(candidates_[cell.first + k]);
    const double above = above_m(facet, centre);
    distances_m_[k] = std::abs(above);
    if (distances_m_[k] > nearest_m + 2 * slack_m) continue;
    const double beside = beside_m(facet, centre), square = above * above + beside * beside,
                 told = square - kPrefersBelow * above * above;
    distances_m_[k] = std::sqrt(square);
    nearest_m = std::min(nearest_m, distances_m_[k]);
    if (told < least_square) least_square = told, nearest_above_m = above;
  }
  cell.deepest_m = (nearest_above_m > 0 ? -nearest_m : nearest_m) + slack_m;
  if (nearest_m > tolerance_m_ + reach_m || !(cell.deepest_m > lowest_m)) return false;
  const auto first = static_cast<std::uint32_t>(candidates_.size());
  bool counts = false;
  for (std::uint32_t k = 0; k < cell.count && candidates_.size() < kMostCandidates; ++k) {
    const std::uint32_t candidate = candidates_[cell.first + k];
    if (distances_m_[k] > nearest_m + 2 * slack_m) continue;
    candidates_.push_back(candidate);
    counts = counts || counts_[s_.facet(candidate).piece] != 0;
  }
  cell.first = first;
  cell.count = static_cast<std::uint32_t>(candidates_.size()) - first;
  return counts;
}

/// Adds what the points of a triangle of T weigh.
void PointDepth::look_into(const Cell& whole, double point_m, Sums& sums) noexcept {
  const auto bottom = static_cast<std::uint32_t>(candidates_.size());
  cells_.clear();
  cells_.push_back(whole);
  while (!cells_.empty()) {
    Cell cell = cells_.back();
    cells_.pop_back();
    candidates_.resize(std::max(bottom, cell.first + cell.count));  // what cells done with had on the stack goes
    if (!narrow(cell, sums.level_m - kTailWidths * sums.width_m)) continue;
    const auto& [a, b, c] = cell.corners_S;
    const double longest = std::max({glm::dot(a - b, a - b), glm::dot(b - c, b - c), glm::dot(c - a, c - a)});
    if (longest <= point_m * point_m || cell.level + 1 >= kMostLevels) {
      feel(cell, sums);
      continue;
    }
    const auto halves = [](const std::array<glm::dvec3, 3>& p) {
      return std::array<glm::dvec3, 3>{0.5 * (p[0] + p[1]), 0.5 * (p[1] + p[2]), 0.5 * (p[2] + p[0])};
    };
    const std::array<glm::dvec3, 3>&t = cell.corners_T, &s = cell.corners_S, mid_t = halves(t), mid_s = halves(s);
    const auto part = [&](std::size_t corner) {
      Cell one = cell;
      one.corners_T = {t[corner], mid_t[corner], mid_t[(corner + 2) % 3]};
      one.corners_S = {s[corner], mid_s[corner], mid_s[(corner + 2) % 3]};
      ++one.level;
      return one;
    };
    for (const std::size_t corner : {0, 1, 2}) cells_.push_back(part(corner));
    cell.corners_T = mid_t, cell.corners_S = mid_s;
    ++cell.level;
    cells_.push_back(cell);
  }
  candidates_.resize(bottom);
}

/// The cell as one point of T's displaced surface.
void PointDepth::feel(const Cell& cell, Sums& sums) noexcept {
  ++points_;
  const FacetedSurface::Facet& tool = t_.facet(cell.triangle);
  glm::dvec3 p_T = (cell.corners_T[0] + cell.corners_T[1] + cell.corners_T[2]) / 3.0;
  if (tool.chart != geometry::kNoChart) {
    const geometry::HapticSurface& felt = t_.felt().haptic();
    glm::dvec3 p_H = (p_T - tool.p_OH) * tool.R_OH;
    p_H.z = geometry::sample_height(felt, felt.charts[tool.chart], p_H.x, p_H.y).h_m;
    p_T = tool.p_OH + tool.R_OH * p_H;
  }
  const glm::dvec3 p_S = spatial::transform_point(sums.X_ST, p_T), nhat_S = spatial::rotate(sums.X_ST, tool.nhat_O);
  double least = std::numeric_limits<double>::infinity(), depth_m = 0;
  glm::dvec3 slope_S{0};
  const FacetedSurface::Facet* nearest = nullptr;
  for (std::uint32_t k = 0; k < cell.count; ++k) {
    const std::uint32_t candidate = candidates_[cell.first + k];
    const FacetedSurface::Facet& facet = s_.facet(candidate);
    const penetration::Relief& relief = s_.felt().relief(candidate);
    // However its relief lies, it cannot be nearer than this.
    const double above = above_m(facet, p_S), apart_m = std::max({above - relief.high_m, relief.low_m - above, 0.0});
    const double along = 1 + kPrefersFacing * (1 + glm::dot(facet.nhat_O, nhat_S));
    if (along * (1 - kPrefersBelow) * apart_m * apart_m >= least) continue;
    const double beside = beside_m(facet, p_S);
    if (along * ((1 - kPrefersBelow) * apart_m * apart_m + beside * beside) >= least) continue;
    double deep_m = -above;
    glm::dvec3 slope = -facet.nhat_O;
    if (facet.chart != geometry::kNoChart) {
      const geometry::HapticSurface& felt = s_.felt().haptic();
      const glm::dvec3 p_H = (p_S - facet.p_OH) * facet.R_OH;
      const geometry::HeightSample h = geometry::sample_height(felt, felt.charts[facet.chart], p_H.x, p_H.y);
      deep_m = h.h_m - p_H.z;
      slope = facet.R_OH * glm::dvec3{h.h_s, h.h_t, -1};
    }
    const double square = along * ((1 - kPrefersBelow) * deep_m * deep_m + beside * beside);
    if (!(square < least)) continue;
    least = square, depth_m = deep_m, slope_S = slope, nearest = &facet;
  }
  if (!nearest || counts_[nearest->piece] == 0 || least > tolerance_m_ * tolerance_m_) return;
  if (depth_m < sums.level_m - kTailWidths * sums.width_m) return;
  const auto& [a, b, c] = cell.corners_T;
  const double area_m2 = 0.5 * glm::length(glm::cross(b - a, c - a)),
               along = counts_along(glm::dot(nearest->nhat_O, sums.nhat_ST_S));
  if (along > 0) sums.add(depth_m, along * area_m2, p_S, slope_S);
}

}  // namespace farfeel::contact
