#include "tests/support/plate_truth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::support {
namespace {

using spatial::Pose;

constexpr double kCell_m = 40e-6;          ///< of the look from afar
constexpr double kHiddenInCell_m = 60e-6;  ///< what may rise above a cell's middle: half of the highest spike
constexpr double kTailWidths = 15;
constexpr double kHardNode_m = 20e-6;

/// A spike of one texel, 40 um wide and 150 um high, bends down by about 0.1 / um: its weight has a standard deviation
/// of the root of the width over that, 10 um at a width of 10 um.
double node_m(double soft_width_m) {
  return soft_width_m < 15e-6 ? 4e-6 : soft_width_m < 40e-6 ? 5e-6 : soft_width_m < 100e-6 ? 10e-6 : 20e-6;
}

/// How much of a place's weight is kept so far inside an edge, and its slope.
double keep_at(double inside_m) {
  const double x = std::clamp(inside_m / penetration::kEdgeFade_m, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}
double keep_slope_1_per_m(double inside_m) {
  const double x = std::clamp(inside_m / penetration::kEdgeFade_m, 0.0, 1.0);
  return 6 * x * (1 - x) / penetration::kEdgeFade_m;
}

}  // namespace

struct PlateTruth::Node {
  double overlap_m, keep;
  glm::dvec3 slope;                ///< of T along S's axes, with z = 1: minus the overlap's gradient by T's translation
  glm::dvec2 relative_1_per_m{0};  ///< d ln keep / d translation of T
};

PlateTruth::Field::Field(const geometry::HapticSurface& plate) {
  const geometry::Chart& chart = plate.charts.front();
  columns = chart.columns, rows = chart.rows, texel_m = chart.texel_m;
  low = glm::dvec2{chart.X_OH.p};
  half_m = glm::dvec2{plate.coarse.positions_O[2]};
  coefficients_m.resize((columns + 2) * (rows + 2));
  constexpr std::size_t kTexels = geometry::kTileTexels;
  for (std::size_t j = 0; j < rows + 2; ++j) {
    for (std::size_t i = 0; i < columns + 2; ++i) {
      // Coefficient (i, j) is column i of the tile that holds texel i - 1, or a border column of a neighbour.
      const std::size_t across = std::min((i > 0 ? i - 1 : 0) / kTexels, std::size_t{chart.tiles_across()} - 1),
                        down = std::min((j > 0 ? j - 1 : 0) / kTexels, std::size_t{chart.tiles_down()} - 1);
      const geometry::HeightTile& tile = plate.tiles[chart.first_tile + down * chart.tiles_across() + across];
      coefficients_m[j * (columns + 2) + i] = plate.scale.height_m(tile.at(i - across * kTexels, j - down * kTexels));
    }
  }
}

glm::dvec3 PlateTruth::Field::at(double x, double y) const {
  const auto texel_of = [this](double along_m, double from_m, std::size_t count) {
    return std::clamp((along_m - from_m) / texel_m, 0.0, static_cast<double>(count) - 1e-9);
  };
  const double a = texel_of(x, low.x, columns), b = texel_of(y, low.y, rows);
  const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
  const double p = a - static_cast<double>(i), q = b - static_cast<double>(j);
  const auto weights = [](double f) { return std::array{0.5 * (1 - f) * (1 - f), 0.5 + f * (1 - f), 0.5 * f * f}; };
  const auto slopes = [](double f) { return std::array{f - 1, 1 - 2 * f, f}; };
  const auto wx = weights(p), wy = weights(q), dx = slopes(p), dy = slopes(q);
  glm::dvec3 sum{0};
  for (std::size_t m = 0; m < 3; ++m) {
    const double* row = &coefficients_m[(j + m) * (columns + 2) + i];
    const double along = wx[0] * row[0] + wx[1] * row[1] + wx[2] * row[2];
    const double slope = dx[0] * row[0] + dx[1] * row[1] + dx[2] * row[2];
    sum += glm::dvec3{wy[m] * along, wy[m] * slope, dy[m] * along};
  }
  return {sum.x, sum.y / texel_m, sum.z / texel_m};
}

PlateTruth::PlateTruth(const geometry::HapticSurface& s, const geometry::HapticSurface& t) : s_(s), t_(t) {}

PlateTruth::Places PlateTruth::places(const Pose& X_ST) const {
  Places box{glm::dvec2{std::numeric_limits<double>::infinity()}, glm::dvec2{-std::numeric_limits<double>::infinity()}};
  for (const glm::dvec2 corner : {glm::dvec2{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    const glm::dvec2 uv{spatial::transform_point(X_ST, glm::dvec3{corner * t_.half_m, 0})};
    box.low = glm::min(box.low, uv), box.high = glm::max(box.high, uv);
  }
  return {glm::max(box.low, -s_.half_m), glm::min(box.high, s_.half_m)};
}

bool PlateTruth::overlap_at(const Pose& X_ST, const glm::dvec2& uv, Node& node) const {
  const double s_inside_m = std::min(s_.half_m.x - std::abs(uv.x), s_.half_m.y - std::abs(uv.y));
  if (!(s_inside_m > 0)) return false;
  // T's own coordinates of a place (u, v, z) are affine in z: the foot of its plane first.
  const glm::dquat R_TS = glm::conjugate(X_ST.R);
  const glm::dvec3 per_z = R_TS * glm::dvec3{0, 0, 1}, at_zero = R_TS * (glm::dvec3{uv, 0} - X_ST.p);
  double z = -at_zero.z / per_z.z;
  const glm::dvec3 foot = at_zero + z * per_z;
  const double t_inside_x_m = t_.half_m.x - std::abs(foot.x), t_inside_y_m = t_.half_m.y - std::abs(foot.y);
  const double t_inside_m = std::min(t_inside_x_m, t_inside_y_m);
  if (!(t_inside_m > 0)) return false;
  glm::dvec3 height{0};
  for (int pass = 0; pass < 8; ++pass) {
    const glm::dvec3 q = at_zero + z * per_z;
    height = t_.at(q.x, q.y);
    const double step = (q.z - height.x) / (per_z.z - height.y * per_z.x - height.z * per_z.y);
    z -= step;
    if (std::abs(step) < 1e-12) break;
  }
  const glm::dvec3 N = X_ST.R * glm::dvec3{-height.y, -height.z, 1};
  node.overlap_m = s_.at(uv.x, uv.y).x - z;
  node.slope = N / N.z;
  node.keep = keep_at(s_inside_m) * keep_at(t_inside_m);
  node.relative_1_per_m = {0, 0};
  if (t_inside_m < penetration::kEdgeFade_m) {
    const glm::dvec3 inward_T =
        t_inside_x_m < t_inside_y_m ? glm::dvec3{foot.x > 0 ? -1 : 1, 0, 0} : glm::dvec3{0, foot.y > 0 ? -1 : 1, 0};
    node.relative_1_per_m = -(keep_slope_1_per_m(t_inside_m) / keep_at(t_inside_m)) * glm::dvec2{X_ST.R * inward_T};
  }
  return node.keep > 0;
}

double PlateTruth::hard_depth_m(const Pose& X_ST) const {
  const Places box = places(X_ST);
  double best_m = -std::numeric_limits<double>::infinity();
  Node node;
  for (double v = box.low.y; v < box.high.y; v += kHardNode_m) {
    for (double u = box.low.x; u < box.high.x; u += kHardNode_m) {
      if (overlap_at(X_ST, {u, v}, node)) best_m = std::max(best_m, node.overlap_m);
    }
  }
  return best_m;
}

PlateTruth::Soft PlateTruth::soft(const Pose& X_ST, double soft_width_m) const {
  const Places box = places(X_ST);
  const glm::dvec2 size = box.high - box.low;
  const auto across = static_cast<std::size_t>(std::ceil(size.x / kCell_m)),
             down = static_cast<std::size_t>(std::ceil(size.y / kCell_m));
  const auto middle = [&](std::size_t i, std::size_t j) {
    return box.low + kCell_m * (glm::dvec2{static_cast<double>(i), static_cast<double>(j)} + 0.5);
  };
  constexpr double kNone = -std::numeric_limits<double>::infinity();
  std::vector<double> seen(across * down, kNone);
  Node node;
  for (std::size_t j = 0; j < down; ++j) {
    for (std::size_t i = 0; i < across; ++i) {
      // A cell that the edge goes through is looked at by what of it is over both plates.
      if (overlap_at(X_ST, glm::min(middle(i, j), box.high - 1e-9), node)) seen[j * across + i] = node.overlap_m;
    }
  }
  const double level_m = *std::max_element(seen.begin(), seen.end());
  const double lowest_m = level_m - kTailWidths * soft_width_m - kHiddenInCell_m;
  const auto nodes = static_cast<int>(std::lround(kCell_m / node_m(soft_width_m)));
  const double step_m = kCell_m / nodes;
  double weight = 0;
  glm::dvec3 gradient{0};
  for (std::size_t j = 0; j < down; ++j) {
    for (std::size_t i = 0; i < across; ++i) {
      // T may be turned, so that its edge goes through cells whose middle is beside it.
      if (seen[j * across + i] < lowest_m && seen[j * across + i] != kNone) continue;
      for (int m = 0; m < nodes * nodes; ++m) {
        const glm::dvec2 aside{m % nodes - 0.5 * (nodes - 1), m / nodes - 0.5 * (nodes - 1)};
        if (!overlap_at(X_ST, middle(i, j) + step_m * aside, node)) continue;
        const double w = step_m * step_m * node.keep * std::exp((node.overlap_m - level_m) / soft_width_m);
        weight += w;
        gradient += w * (glm::dvec3{soft_width_m * node.relative_1_per_m, 0} - node.slope);
      }
    }
  }
  return {level_m + soft_width_m * std::log(weight / penetration::kReferenceArea_m2), gradient / weight};
}

}  // namespace farfeel::support
