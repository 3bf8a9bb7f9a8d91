#include "slave_sim/world/exploration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace farfeel::slave_sim {
namespace {

constexpr double kReach = 0.1;   // of a place's surroundings and of its region, as a share of the object's width
constexpr double kLevel = 0.9;   // least z of a normal that faces up: within 26 degrees
constexpr int kCells = 96;       // of the height map, along the longer side
constexpr double kSteep = 0.7;   // rise over run between neighbouring cells that still counts as no step
constexpr double kRegion = 0.5;  // of the reach: strokes stay well inside what was found level

/// The object from above: the highest surface in every cell, and whether it faces up there.
class HeightMap {
 public:
  HeightMap(const geometry::TriangleMesh& mesh_O, const spatial::Pose& X_WO) {
    std::vector<glm::dvec3> p_W;
    for (const glm::dvec3& p_O : mesh_O.positions_O) {
      p_W.push_back(spatial::transform_point(X_WO, p_O));
      box_W_.include(p_W.back());
    }
    const glm::dvec3 size = box_W_.size();
    cell_m_ = std::max(size.x, size.y) / kCells;
    columns_ = static_cast<int>(size.x / cell_m_) + 1, rows_ = static_cast<int>(size.y / cell_m_) + 1;
    z_m_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kNothing);
    faces_up_.assign(z_m_.size(), false);
    for (const auto& [a, b, c] : mesh_O.triangles) draw(p_W[a], p_W[b], p_W[c]);
  }

  [[nodiscard]] glm::ivec2 size() const { return {columns_, rows_}; }
  [[nodiscard]] double cell_m() const { return cell_m_; }
  [[nodiscard]] double width_m() const { return std::max(box_W_.size().x, box_W_.size().y); }
  [[nodiscard]] bool is_level(int i, int j) const { return is_inside(i, j) && faces_up_[index(i, j)]; }
  [[nodiscard]] double z_m(int i, int j) const { return z_m_[index(i, j)]; }
  [[nodiscard]] glm::dvec3 place_W(int i, int j) const {
    return {box_W_.low.x + (i + 0.5) * cell_m_, box_W_.low.y + (j + 0.5) * cell_m_, z_m(i, j)};
  }

 private:
  static constexpr double kNothing = -std::numeric_limits<double>::infinity();

  [[nodiscard]] bool is_inside(int i, int j) const { return i >= 0 && j >= 0 && i < columns_ && j < rows_; }
  [[nodiscard]] std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(i);
  }
  void draw(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    if (!(normal.z > 0)) return;
    const auto cell = [&](double at, double low) { return static_cast<int>((at - low) / cell_m_); };
    const glm::dvec3 low = glm::min(a, glm::min(b, c)), high = glm::max(a, glm::max(b, c));
    for (int j = cell(low.y, box_W_.low.y); j <= cell(high.y, box_W_.low.y); ++j) {
      for (int i = cell(low.x, box_W_.low.x); i <= cell(high.x, box_W_.low.x); ++i) {
        if (!is_inside(i, j)) continue;
        const glm::dvec2 at{box_W_.low.x + (i + 0.5) * cell_m_, box_W_.low.y + (j + 0.5) * cell_m_};
        const auto side = [&](const glm::dvec3& p, const glm::dvec3& q) {
          return (q.x - p.x) * (at.y - p.y) - (q.y - p.y) * (at.x - p.x);
        };
        if (side(a, b) < 0 || side(b, c) < 0 || side(c, a) < 0) continue;
        const double z = a.z - (normal.x * (at.x - a.x) + normal.y * (at.y - a.y)) / normal.z;
        if (!(z > z_m_[index(i, j)])) continue;
        z_m_[index(i, j)] = z;
        faces_up_[index(i, j)] = normal.z > kLevel * glm::length(normal);
      }
    }
  }

  geometry::Box box_W_;
  double cell_m_ = 0;
  int columns_ = 0, rows_ = 0;
  std::vector<double> z_m_;
  std::vector<bool> faces_up_;
};

/// How many cells about (i, j) face up without a step from it, and how low and high they lie within the region.
struct Surroundings {
  int level_cells = 0;
  double low_m, high_m;
};

Surroundings around(const HeightMap& map, int i, int j, int reach) {
  const double middle_m = map.z_m(i, j);
  Surroundings found{0, middle_m, middle_m};
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      if (x * x + y * y > reach * reach || !map.is_level(i + x, j + y)) continue;
      const double z_m = map.z_m(i + x, j + y);
      if (std::abs(z_m - middle_m) > kSteep * map.cell_m() * (std::hypot(x, y) + 1)) continue;
      ++found.level_cells;
      if (std::hypot(x, y) > kRegion * reach) continue;
      found.low_m = std::min(found.low_m, z_m), found.high_m = std::max(found.high_m, z_m);
    }
  }
  return found;
}

}  // namespace

codecs::Exploration exploration_from_above(const codecs::Asset& object, const spatial::Pose& X_WO,
                                           const codecs::Asset& tool) {
  const HeightMap map(object.felt.coarse, X_WO);
  const int reach = std::max(1, static_cast<int>(kReach * map.width_m() / map.cell_m()));
  Surroundings best{-1, 0, 0};
  glm::dvec3 place_W(0);
  for (int j = 0; j < map.size().y; ++j) {
    for (int i = 0; i < map.size().x; ++i) {
      if (!map.is_level(i, j)) continue;
      const Surroundings found = around(map, i, j, reach);
      if (found.level_cells <= best.level_cells) continue;
      best = found;
      place_W = map.place_W(i, j);
    }
  }
  if (best.level_cells < 0) {  // nothing faces up: the highest vertex
    place_W.z = -std::numeric_limits<double>::infinity();
    for (const glm::dvec3& p_O : object.felt.coarse.positions_O) {
      const glm::dvec3 p_W = spatial::transform_point(X_WO, p_O);
      if (p_W.z > place_W.z) place_W = p_W;
    }
    best = {0, place_W.z, place_W.z};
  }
  const auto lower = [](const glm::dvec3& a, const glm::dvec3& b) { return a.z < b.z; };
  const auto& tool_points = tool.felt.coarse.positions_O;
  const double half_m = kRegion * kReach * map.width_m();
  codecs::Exploration exploration;
  exploration.p_TWork_T = *std::min_element(tool_points.begin(), tool_points.end(), lower);
  exploration.region_low_W = {place_W.x - half_m, place_W.y - half_m, best.low_m};
  exploration.region_high_W = {place_W.x + half_m, place_W.y + half_m, best.high_m};
  return exploration;
}

}  // namespace farfeel::slave_sim
