// By the paper, of corners P_i with normals N_i: the control point of the side from i to j near i is
//   (2 P_i + P_j - ((P_j - P_i) . N_i) N_i) / 3,
// and the centre is E + (E - V) / 2, E the mean of the sides' six, V of the corners. Normals are those of faces that
// hang together round a vertex without a sharp edge, by area: so both sides of an edge that is not sharp say the same.
#include "codecs/asset/curved_mesh.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>

namespace farfeel::codecs {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

constexpr double kSharpCosine = 0.766;  // of 40 degrees

/// Corners, three a triangle, in sets.
class Corners {
 public:
  explicit Corners(std::size_t count) : above_(count) { std::iota(above_.begin(), above_.end(), 0U); }
  std::uint32_t set_of(std::uint32_t corner) {
    while (above_[corner] != corner) corner = above_[corner] = above_[above_[corner]];
    return corner;
  }
  void unite(std::uint32_t one, std::uint32_t other) {
    const std::uint32_t a = set_of(one), b = set_of(other);
    above_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> above_;
};

glm::dvec3 unit_or_zero(const glm::dvec3& v) {
  const double length = glm::length(v);
  return length > 0 ? v / length : glm::dvec3(0);
}

glm::dvec3 doubled_area(const TriangleMesh& mesh, const Triangle& t) {
  const glm::dvec3& a = mesh.positions_O[t[0]];
  return glm::cross(mesh.positions_O[t[1]] - a, mesh.positions_O[t[2]] - a);
}

}  // namespace

CurvedMesh::CurvedMesh(const TriangleMesh& mesh) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  std::unordered_map<std::uint64_t, std::uint32_t> corner_of_edge;  // where the edge begins
  std::vector<glm::dvec3> areas;
  for (std::uint32_t t = 0; t < count; ++t) {
    const Triangle& v = mesh.triangles[t];
    areas.push_back(doubled_area(mesh, v));
    for (std::uint32_t k = 0; k < 3; ++k) corner_of_edge[std::uint64_t{v[k]} << 32 | v[(k + 1) % 3]] = 3 * t + k;
  }
  Corners corners(std::size_t{3} * count);
  std::vector<bool> is_smooth(std::size_t{3} * count);  // of the edge that begins at the corner
  for (std::uint32_t t = 0; t < count; ++t) {
    const Triangle& v = mesh.triangles[t];
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto across = corner_of_edge.find(std::uint64_t{v[(k + 1) % 3]} << 32 | v[k]);
      if (across == corner_of_edge.end()) continue;
      const std::uint32_t begin = across->second, other = begin / 3, end = 3 * other + (begin + 1) % 3;
      if (glm::dot(unit_or_zero(areas[t]), unit_or_zero(areas[other])) < kSharpCosine) continue;
      is_smooth[3 * t + k] = true;
      corners.unite(3 * t + k, end);
      corners.unite(3 * t + (k + 1) % 3, begin);
    }
  }
  std::vector<glm::dvec3> sums(std::size_t{3} * count, glm::dvec3(0));
  for (std::uint32_t c = 0; c < 3 * count; ++c) sums[corners.set_of(c)] += areas[c / 3];
  for (std::uint32_t t = 0; t < count; ++t) {
    Patch patch{};
    for (std::uint32_t k = 0; k < 3; ++k) {
      patch.corner[k] = mesh.positions_O[mesh.triangles[t][k]];
      patch.normal[k] = unit_or_zero(sums[corners.set_of(3 * t + k)]);
    }
    glm::dvec3 sides(0);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto near = [&](std::uint32_t from, std::uint32_t to) {
        const glm::dvec3 way = patch.corner[to] - patch.corner[from], &n = patch.normal[from];
        return patch.corner[from] + (is_smooth[3 * t + k] ? way - glm::dot(way, n) * n : way) / 3.0;
      };
      patch.side[k] = {near(k, (k + 1) % 3), near((k + 1) % 3, k)};
      sides += patch.side[k][0] + patch.side[k][1];
    }
    const glm::dvec3 middle = (patch.corner[0] + patch.corner[1] + patch.corner[2]) / 3.0;
    patch.centre = sides / 6.0 + (sides / 6.0 - middle) / 2.0;
    patches_.push_back(patch);
  }
}

glm::dvec3 CurvedMesh::point(std::size_t triangle, const glm::dvec3& w) const {
  const Patch& patch = patches_[triangle];
  glm::dvec3 sum = 6 * w.x * w.y * w.z * patch.centre;
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const auto i = static_cast<std::size_t>(k);
    sum += w[k] * w[k] * w[k] * patch.corner[i];
    sum += 3 * w[k] * w[next] * (w[k] * patch.side[i][0] + w[next] * patch.side[i][1]);
  }
  return sum;
}

glm::dvec3 CurvedMesh::normal(std::size_t triangle, const glm::dvec3& w) const {
  const auto& [a, b, c] = patches_[triangle].normal;
  return unit_or_zero(w.x * a + w.y * b + w.z * c);
}

glm::dvec3 CurvedMesh::middle(std::size_t triangle) const {
  const auto& [a, b, c] = patches_[triangle].corner;
  return (a + b + c) / 3.0;
}

/// A patch lies within the hull of its control points.
double CurvedMesh::radius_m(std::size_t triangle) const {
  const Patch& patch = patches_[triangle];
  const glm::dvec3 from = middle(triangle);
  double most = glm::length(patch.centre - from);
  for (std::size_t k = 0; k < 3; ++k) {
    for (const glm::dvec3& p : {patch.corner[k], patch.side[k][0], patch.side[k][1]})
      most = std::max(most, glm::length(p - from));
  }
  return most;
}

}  // namespace farfeel::codecs
