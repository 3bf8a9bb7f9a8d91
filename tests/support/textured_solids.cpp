#include "tests/support/textured_solids.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <utility>

#include "haptic_core/geometry/height_field_fit.h"
#include "tests/support/solids.h"

namespace farfeel::support {
namespace {

using geometry::HapticSurface;
using geometry::Triangle;
using geometry::TriangleMesh;

constexpr double kOnePlane = 1 - 1e-9;  ///< cosine of faces that share a chart

/// Triangles in groups of plane faces: neighbours in one piece whose normals agree.
std::vector<std::vector<std::uint32_t>> plane_faces(const HapticSurface& surface) {
  const TriangleMesh& mesh = surface.coarse;
  std::vector<std::uint32_t> face_of(mesh.triangles.size(), geometry::kNoChart);
  std::vector<std::vector<std::uint32_t>> faces;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (face_of[i] != geometry::kNoChart) continue;
    std::vector<std::uint32_t> face{i};
    face_of[i] = static_cast<std::uint32_t>(faces.size());
    const glm::dvec3 n = geometry::unit_normal(mesh, mesh.triangles[i]);
    for (std::size_t k = 0; k < face.size(); ++k) {
      for (std::uint32_t j = 0; j < mesh.triangles.size(); ++j) {
        if (face_of[j] != geometry::kNoChart || surface.triangle_piece[j] != surface.triangle_piece[i]) continue;
        int shared = 0;
        for (const std::uint32_t v : mesh.triangles[j]) {
          shared += std::count(mesh.triangles[face[k]].begin(), mesh.triangles[face[k]].end(), v) > 0;
        }
        if (shared < 2 || glm::dot(n, geometry::unit_normal(mesh, mesh.triangles[j])) < kOnePlane) continue;
        face_of[j] = face_of[i];
        face.push_back(j);
      }
    }
    faces.push_back(face);
  }
  return faces;
}

/// Points in cubes of one size, to find those near a place.
class Cubes {
 public:
  Cubes(const std::vector<DensePoint>& points, double side_m) : points_(points), side_m_(side_m) {
    for (std::uint32_t i = 0; i < points.size(); ++i) cubes_[key_of(cube_of(points[i].p_O))].push_back(i);
  }
  /// Calls visit(point) for all within a cube's side of p, and some beyond.
  template <typename Visit>
  void near(const glm::dvec3& p, const Visit& visit) const {
    const glm::ivec3 at = cube_of(p);
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          const auto found = cubes_.find(key_of(at + glm::ivec3{x, y, z}));
          if (found == cubes_.end()) continue;
          for (const std::uint32_t i : found->second) visit(points_[i]);
        }
  }

 private:
  [[nodiscard]] glm::ivec3 cube_of(const glm::dvec3& p) const { return glm::ivec3{glm::floor(p / side_m_)}; }
  static std::uint64_t key_of(const glm::ivec3& c) {
    const auto part = [](int x) { return static_cast<std::uint64_t>(x + (1 << 20)) & 0x1F'FFFF; };
    return part(c.x) << 42 | part(c.y) << 21 | part(c.z);
  }

  const std::vector<DensePoint>& points_;
  double side_m_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cubes_;
};

}  // namespace

HapticSurface textured(TriangleMesh mesh, const std::function<double(const glm::dvec3&)>& relief_m, double texel_m) {
  HapticSurface surface = untextured(std::move(mesh));
  const TriangleMesh& coarse = surface.coarse;
  constexpr std::uint32_t kMargin = 6;  // texels beyond the face on every side
  std::vector<geometry::SampledChart> charts;
  for (const std::vector<std::uint32_t>& face : plane_faces(surface)) {
    const glm::dquat R_OH = spatial::frame_with_z(geometry::unit_normal(coarse, coarse.triangles[face.front()]));
    const glm::dvec3 origin = coarse.positions_O[coarse.triangles[face.front()][0]];
    glm::dvec2 low{std::numeric_limits<double>::infinity()}, high = -low;
    for (const std::uint32_t i : face) {
      surface.triangle_chart[i] = static_cast<std::uint32_t>(charts.size());
      for (const std::uint32_t v : coarse.triangles[i]) {
        const glm::dvec2 at{glm::conjugate(R_OH) * (coarse.positions_O[v] - origin)};
        low = glm::min(low, at), high = glm::max(high, at);
      }
    }
    const auto across = [&](double length_m) {
      return static_cast<std::uint32_t>(std::ceil(length_m / texel_m)) + 2 * kMargin;
    };
    geometry::SampledChart chart{.X_OH = {R_OH, origin + R_OH * glm::dvec3{low - kMargin * texel_m, 0}},
                                 .texel_m = texel_m,
                                 .columns = across(high.x - low.x),
                                 .rows = across(high.y - low.y),
                                 .heights_m = {}};
    for (std::uint32_t j = 0; j < chart.rows; ++j) {
      for (std::uint32_t i = 0; i < chart.columns; ++i) {
        chart.heights_m.push_back(
            relief_m(spatial::transform_point(chart.X_OH, {(i + 0.5) * texel_m, (j + 0.5) * texel_m, 0})));
      }
    }
    charts.push_back(std::move(chart));
  }
  geometry::set_height_fields(surface, charts);
  return surface;
}

std::vector<DensePoint> dense_points(const HapticSurface& surface, double spacing_m,
                                     const std::function<bool(const glm::dvec3&)>& counts) {
  const TriangleMesh& mesh = surface.coarse;
  std::vector<DensePoint> points;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::dvec3 a = mesh.positions_O[mesh.triangles[i][0]], b = mesh.positions_O[mesh.triangles[i][1]],
                     c = mesh.positions_O[mesh.triangles[i][2]];
    if (!counts((a + b + c) / 3.0)) continue;
    const double longest_m = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
    const int n = std::max(1, static_cast<int>(std::ceil(longest_m / spacing_m)));
    const double coarse_area_m2 = 0.5 * glm::length(glm::cross(b - a, c - a)) / (n * n);
    const std::uint32_t index = surface.triangle_chart[i];
    for (int row = 0; row < n; ++row) {
      for (int k = 0; k < 2 * row + 1; ++k) {  // the centres of n^2 equal parts
        const bool is_upright = k % 2 == 0;
        const double u = (row + (is_upright ? 2.0 : 1.0) / 3) / n, v = (k / 2 + (is_upright ? 1.0 : 2.0) / 3) / n;
        const glm::dvec3 p = a + u * (b - a) + v * (c - b);
        if (index == geometry::kNoChart) {
          points.push_back({p, geometry::unit_normal(mesh, mesh.triangles[i]), coarse_area_m2});
          continue;
        }
        const geometry::Chart& chart = surface.charts[index];
        glm::dvec3 p_H = spatial::transform_point(spatial::inverse(chart.X_OH), p);
        const geometry::HeightSample h = geometry::sample_height(surface, chart, p_H.x, p_H.y);
        p_H.z = h.h_m;
        const glm::dvec3 n_H{-h.h_s, -h.h_t, 1};
        points.push_back({spatial::transform_point(chart.X_OH, p_H), glm::normalize(spatial::rotate(chart.X_OH, n_H)),
                          coarse_area_m2 * glm::length(n_H)});
      }
    }
  }
  return points;
}

DenseDepth dense_depth(const std::vector<DensePoint>& s, const std::vector<DensePoint>& t, const spatial::Pose& X_ST,
                       double reach_m, double soft_width_m, double reference_area_m2) {
  constexpr double kFacing = 0.3;   // cosine
  constexpr double kThrough = 0.5;  // of the distance to what faces it a point is that far from everything
  constexpr double kNear = 1.2;     // of the distance to the nearest point: those that tell on which side it is
  constexpr double kSquare = 2;     // of the points' spacing: how far beside its nearest point a point's foot may be
  const Cubes cubes(s, reach_m);
  DenseDepth deepest{-std::numeric_limits<double>::infinity(), glm::dvec3{0}, glm::dvec3{0}, 0};
  std::vector<std::pair<double, double>> depths;  // and areas
  for (const DensePoint& point : t) {
    const glm::dvec3 p = spatial::transform_point(X_ST, point.p_O), n = spatial::rotate(X_ST, point.nhat_O);
    const DensePoint* facing = nullptr;
    double least = reach_m * reach_m, least_facing = least;
    cubes.near(p, [&](const DensePoint& other) {
      const glm::dvec3 apart = other.p_O - p;
      const double square = glm::dot(apart, apart);
      least = std::min(least, square);
      if (square < least_facing && glm::dot(n, other.nhat_O) < -kFacing) least_facing = square, facing = &other;
    });
    if (!facing) continue;
    const glm::dvec3 apart = facing->p_O - p;
    const double depth_m = glm::dot(apart, facing->nhat_O);
    // What faces the point may be S's other side, which nothing came near: far behind what is near, or behind air. At
    // an edge relief sinks both faces, and what is left of either beyond the other tells wrong.
    bool is_beneath = true;
    cubes.near(p, [&](const DensePoint& other) {
      const glm::dvec3 away = other.p_O - p;
      is_beneath = is_beneath && (glm::dot(away, away) > kNear * kNear * least || glm::dot(away, other.nhat_O) > 0);
    });
    if (depth_m > 0 && (!is_beneath || least < kThrough * kThrough * least_facing)) continue;
    // Beyond the end of S nothing stands square below the point.
    if (glm::length(apart - depth_m * facing->nhat_O) > kSquare * std::sqrt(facing->area_m2)) continue;
    depths.emplace_back(depth_m, point.area_m2);
    if (depth_m > deepest.depth_m) deepest.depth_m = depth_m, deepest.p_S = p, deepest.nhat_S_S = facing->nhat_O;
  }
  double sum = 0;
  for (const auto& [depth_m, area_m2] : depths) sum += area_m2 * std::exp((depth_m - deepest.depth_m) / soft_width_m);
  deepest.soft_depth_m = deepest.depth_m + soft_width_m * std::log(sum / reference_area_m2);
  return deepest;
}

}  // namespace farfeel::support
