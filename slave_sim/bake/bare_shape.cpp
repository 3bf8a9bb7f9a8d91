// With area vectors A_f, the patch P_f of a triangle f is what a walk from f reaches within the radius; its normal and
// its agreement are direction and length of
//   m_f = sum over P_f of A_g / sum over P_f of |A_g|,   0 <= |m_f| <= 1,
// and the filtered normal of f is that of the sum over g in P_f of w_g |A_g| m_g, where w_g rises from 0 to 1 as |m_g|
// comes near the greatest of P_f. Relief lowers the agreement of all patches alike, so that where there is no edge all
// count; a patch that reaches across an edge agrees less than its neighbours that do not.
#include "slave_sim/bake/bare_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "slave_sim/bake/convex_pieces.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

constexpr int kRounds = 3;        // the second filter sees less relief than the first
constexpr int kVertexSteps = 40;  // a step moves a vertex part of the way to its triangles' planes
/// Agreement, as a share of the greatest around, from where on a patch counts at all, and fully: with a tenth and a
/// thirtieth of it across a right angle.
constexpr double kUntrusted = 0.90, kTrusted = 0.97;

/// Times the median: relief moves about so far, and what would move further is a thin part of the shape itself.
constexpr double kMostMove = 3;

struct Face {
  glm::dvec3 centre{0}, area{0};
  double area_m2 = 0;
};

std::vector<Face> faces_of(const TriangleMesh& mesh) {
  std::vector<Face> faces;
  for (const Triangle& t : mesh.triangles) {
    const glm::dvec3 &a = mesh.positions_O[t[0]], &b = mesh.positions_O[t[1]], &c = mesh.positions_O[t[2]];
    const glm::dvec3 area = 0.5 * glm::cross(b - a, c - a);
    faces.push_back({(a + b + c) / 3.0, area, glm::length(area)});
  }
  return faces;
}

/// Walks over a surface from a triangle as far as the radius.
class Walker {
 public:
  Walker(const std::vector<Face>& faces, const std::vector<Triangle>& neighbours, double radius_m)
      : faces_(faces), neighbours_(neighbours), radius_m_(radius_m), visited_(faces.size(), kNever) {}

  template <typename Visit>
  void walk(std::uint32_t from, Visit visit) {
    reached_.assign(1, from);
    visited_[from] = from;
    for (std::size_t i = 0; i < reached_.size(); ++i) {
      visit(reached_[i]);
      for (const std::uint32_t next : neighbours_[reached_[i]]) {
        if (visited_[next] == from || glm::length(faces_[next].centre - faces_[from].centre) > radius_m_) continue;
        visited_[next] = from;
        reached_.push_back(next);
      }
    }
  }

 private:
  static constexpr std::uint32_t kNever = 0xFFFF'FFFF;
  const std::vector<Face>& faces_;
  const std::vector<Triangle>& neighbours_;
  double radius_m_;
  std::vector<std::uint32_t> visited_;  ///< the last walk's start
  std::vector<std::uint32_t> reached_;
};

std::vector<glm::dvec3> filtered_normals(const std::vector<Face>& faces, const std::vector<Triangle>& neighbours,
                                         double radius_m) {
  Walker walker(faces, neighbours, radius_m);
  std::vector<glm::dvec3> mean(faces.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    glm::dvec3 sum(0);
    double area_m2 = 0;
    walker.walk(f, [&](std::uint32_t g) { sum += faces[g].area, area_m2 += faces[g].area_m2; });
    mean[f] = area_m2 > 0 ? sum / area_m2 : glm::dvec3(0);
  }
  std::vector<glm::dvec3> normals(faces.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    double best = 0;
    walker.walk(f, [&](std::uint32_t g) { best = std::max(best, glm::length(mean[g])); });
    glm::dvec3 sum(0);
    walker.walk(f, [&](std::uint32_t g) {
      const double share = (glm::length(mean[g]) / best - kUntrusted) / (kTrusted - kUntrusted);
      sum += faces[g].area_m2 * std::clamp(share, 0.0, 1.0) * mean[g];
    });
    const double length = glm::length(sum);
    normals[f] = length > 0 ? sum / length : glm::dvec3(0);
  }
  return normals;
}

/// Every vertex goes to where its triangles, each through its own centre, would have their normals.
void follow(TriangleMesh& mesh, const std::vector<glm::dvec3>& normals, const std::vector<glm::dvec3>& home,
            double most_m) {
  std::vector<double> count(mesh.positions_O.size());
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) count[v] += 1;
  }
  std::vector<glm::dvec3> move(mesh.positions_O.size());
  for (int step = 0; step < kVertexSteps; ++step) {
    std::fill(move.begin(), move.end(), glm::dvec3(0));
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      const Triangle& t = mesh.triangles[f];
      const glm::dvec3 centre = (mesh.positions_O[t[0]] + mesh.positions_O[t[1]] + mesh.positions_O[t[2]]) / 3.0;
      for (const std::uint32_t v : t) move[v] += glm::dot(normals[f], centre - mesh.positions_O[v]) * normals[f];
    }
    for (std::size_t v = 0; v < move.size(); ++v) {
      const glm::dvec3 away = mesh.positions_O[v] + move[v] / count[v] - home[v];
      const double length_m = glm::length(away);
      mesh.positions_O[v] = home[v] + (length_m > most_m ? most_m / length_m : 1.0) * away;
    }
  }
}

/// Between vertices of the same index.
double median_distance_m(const TriangleMesh& a, const TriangleMesh& b) {
  std::vector<double> distances_m;
  for (std::size_t v = 0; v < a.positions_O.size(); ++v) {
    distances_m.push_back(glm::length(a.positions_O[v] - b.positions_O[v]));
  }
  const auto middle = distances_m.begin() + static_cast<std::ptrdiff_t>(distances_m.size() / 2);
  std::nth_element(distances_m.begin(), middle, distances_m.end());
  return *middle;
}

}  // namespace

TriangleMesh bare_shape(const TriangleMesh& mesh, double radius_m) {
  const std::vector<Triangle> neighbours = triangle_neighbours(mesh);
  TriangleMesh shape = mesh;
  const auto flatten = [&](double most_m) {
    follow(shape, filtered_normals(faces_of(shape), neighbours, radius_m), mesh.positions_O, most_m);
  };
  flatten(std::numeric_limits<double>::infinity());
  const double most_m = kMostMove * median_distance_m(mesh, shape);
  shape = mesh;
  for (int round = 0; round < kRounds; ++round) flatten(most_m);
  return shape;
}

}  // namespace farfeel::slave_sim
