#include "slave_sim/bake/convex_pieces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

/// Tolerances that a hull may reach across a brink: rough rims would splinter their faces otherwise.
constexpr double kBrinkTolerances = 2.5;
constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

struct Facet {
  glm::dvec3 normal;  ///< unit, or zero for a triangle without area, which no vertex can stand above
  double offset_m, area_m2;
};

std::vector<Facet> facets_of(const TriangleMesh& mesh) {
  std::vector<Facet> facets;
  for (const Triangle& t : mesh.triangles) {
    const glm::dvec3& a = mesh.positions_O[t[0]];
    const glm::dvec3 doubled = glm::cross(mesh.positions_O[t[1]] - a, mesh.positions_O[t[2]] - a);
    const glm::dvec3 n = geometry::unit_normal(mesh, t);
    facets.push_back({n, glm::dot(n, a), 0.5 * glm::length(doubled)});
  }
  return facets;
}

/// The half space of a triangle's plane beyond one of its edges where the surface falls away: air. A piece whose hull
/// reached into it would be felt where nothing is, in a hole or beside a notch.
struct Brink {
  glm::dvec3 outward;  ///< unit, in the triangle's plane; zero where the surface goes on
  double offset_m;
};

std::vector<std::array<Brink, 3>> brinks_of(const TriangleMesh& mesh, const std::vector<Facet>& facets,
                                            const std::vector<Triangle>& neighbours, double least_angle_rad) {
  std::vector<std::array<Brink, 3>> brinks(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      brinks[t][k] = {};
      const glm::dvec3& a = mesh.positions_O[mesh.triangles[t][k]];
      const glm::dvec3 along = mesh.positions_O[mesh.triangles[t][(k + 1) % 3]] - a;
      const glm::dvec3 outward = glm::cross(along, facets[t].normal), n = facets[neighbours[t][k]].normal;
      const bool falls = glm::dot(n, outward) > 0 && glm::dot(n, facets[t].normal) < std::cos(least_angle_rad);
      if (!falls || !(glm::length(outward) > 0)) continue;
      brinks[t][k] = {glm::normalize(outward), glm::dot(glm::normalize(outward), a)};
    }
  }
  return brinks;
}

class Grower {
 public:
  Grower(const TriangleMesh& mesh, const PieceOptions& options)
      : mesh_(mesh),
        facets_(facets_of(mesh)),
        neighbours_(triangle_neighbours(mesh)),
        brinks_(brinks_of(mesh, facets_, neighbours_, options.cone_rad)),
        tolerance_m_(options.tolerance_m),
        piece_(mesh.triangles.size(), kFree),
        has_vertex_(mesh.positions_O.size(), kFree) {}

  /// Grows a piece from the seed over free triangles. cone_rad: see PieceOptions.
  void grow(std::uint32_t seed, std::uint32_t piece, double cone_rad) {
    triangles_.clear(), vertices_.clear();
    normal_sum_ = glm::dvec3(0);
    const double least_cos = std::cos(cone_rad);
    take(seed, piece);
    while (true) {
      // The neighbour that agrees best with the piece so far: pieces stay compact and flat first.
      std::uint32_t best = kFree;
      double best_score = -2;
      for (const std::uint32_t t : triangles_) {
        for (const std::uint32_t n : neighbours_[t]) {
          if (piece_[n] != kFree) continue;
          const double score = agreement(n, piece);
          if (score > best_score && score >= least_cos && stays_convex(n)) best = n, best_score = score;
        }
      }
      if (best == kFree) return;
      take(best, piece);
    }
  }

  void take_all(const std::vector<std::uint32_t>& shell, std::uint32_t piece) {
    for (const std::uint32_t t : shell) piece_[t] = piece;
  }

  [[nodiscard]] const std::vector<Facet>& facets() const { return facets_; }
  [[nodiscard]] const std::vector<Triangle>& neighbours() const { return neighbours_; }
  [[nodiscard]] const std::vector<std::uint32_t>& pieces() const { return piece_; }

 private:
  void take(std::uint32_t t, std::uint32_t piece) {
    piece_[t] = piece;
    triangles_.push_back(t);
    normal_sum_ += facets_[t].area_m2 * facets_[t].normal;
    for (const std::uint32_t v : mesh_.triangles[t]) {
      if (has_vertex_[v] == piece) continue;
      has_vertex_[v] = piece;
      vertices_.push_back(v);
    }
  }

  /// Cosine to the piece's mean normal, in [-1, 1], a little more for triangles that fill a notch.
  [[nodiscard]] double agreement(std::uint32_t t, std::uint32_t piece) const {
    const double length = glm::length(normal_sum_);
    const double cosine = length > 0 ? glm::dot(facets_[t].normal, normal_sum_) / length : 1;
    const auto shared = std::count_if(neighbours_[t].begin(), neighbours_[t].end(),
                                      [&](std::uint32_t n) { return piece_[n] == piece; });
    constexpr double kNotch = 0.02;
    return cosine + kNotch * static_cast<double>(shared - 1);
  }

  [[nodiscard]] bool stays_convex(std::uint32_t added) const {
    for (const std::uint32_t v : vertices_) {
      if (height_m(v, facets_[added]) > tolerance_m_ || is_beyond(v, brinks_[added])) return false;
    }
    for (const std::uint32_t v : mesh_.triangles[added]) {
      for (const std::uint32_t t : triangles_) {
        if (height_m(v, facets_[t]) > tolerance_m_ || is_beyond(v, brinks_[t])) return false;
      }
    }
    return true;
  }

  [[nodiscard]] bool is_beyond(std::uint32_t vertex, const std::array<Brink, 3>& brinks) const {
    return std::any_of(brinks.begin(), brinks.end(), [&](const Brink& brink) {
      return glm::dot(brink.outward, mesh_.positions_O[vertex]) - brink.offset_m > kBrinkTolerances * tolerance_m_;
    });
  }

  [[nodiscard]] double height_m(std::uint32_t vertex, const Facet& facet) const {
    return glm::dot(facet.normal, mesh_.positions_O[vertex]) - facet.offset_m;
  }

  const TriangleMesh& mesh_;
  std::vector<Facet> facets_;
  std::vector<Triangle> neighbours_;
  std::vector<std::array<Brink, 3>> brinks_;
  double tolerance_m_;
  std::vector<std::uint32_t> piece_;
  std::vector<std::uint32_t> has_vertex_;            ///< the piece that a vertex was last taken into
  std::vector<std::uint32_t> triangles_, vertices_;  ///< of the piece being grown
  glm::dvec3 normal_sum_{0};
};

/// The connected shell a triangle belongs to, as triangle indices.
std::vector<std::uint32_t> shell_of(std::uint32_t seed, const std::vector<Triangle>& neighbours) {
  std::vector<bool> seen(neighbours.size());
  std::vector<std::uint32_t> shell{seed};
  seen[seed] = true;
  for (std::size_t i = 0; i < shell.size(); ++i) {
    for (const std::uint32_t n : neighbours[shell[i]]) {
      if (!seen[n]) seen[n] = true, shell.push_back(n);
    }
  }
  return shell;
}

/// No vertex of the shell above the plane of any of its triangles.
bool is_convex(const TriangleMesh& mesh, const std::vector<Facet>& facets, const std::vector<std::uint32_t>& shell,
               double tolerance_m) {
  for (const std::uint32_t t : shell) {
    for (const std::uint32_t other : shell) {
      for (const std::uint32_t v : mesh.triangles[other]) {
        if (glm::dot(facets[t].normal, mesh.positions_O[v]) - facets[t].offset_m > tolerance_m) return false;
      }
    }
  }
  return true;
}

}  // namespace

std::vector<Triangle> triangle_neighbours(const TriangleMesh& mesh) {
  std::unordered_map<std::uint64_t, std::uint32_t> triangle_at;  // by directed edge
  const auto key = [](std::uint64_t from, std::uint64_t to) { return from << 32 | to; };
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) triangle_at[key(mesh.triangles[i][k], mesh.triangles[i][(k + 1) % 3])] = i;
  }
  std::vector<Triangle> neighbours(mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      neighbours[i][k] = triangle_at.at(key(mesh.triangles[i][(k + 1) % 3], mesh.triangles[i][k]));
    }
  }
  return neighbours;
}

ConvexPieces convex_pieces(const TriangleMesh& mesh, const PieceOptions& options) {
  Grower grower(mesh, options);
  ConvexPieces out;
  std::vector<bool> is_judged(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (is_judged[t]) continue;
    const std::vector<std::uint32_t> shell = shell_of(t, grower.neighbours());
    for (const std::uint32_t s : shell) is_judged[s] = true;
    if (!is_convex(mesh, grower.facets(), shell, options.tolerance_m)) continue;
    grower.take_all(shell, out.count++);
  }

  std::vector<std::uint32_t> by_area(mesh.triangles.size());
  std::iota(by_area.begin(), by_area.end(), 0);
  std::stable_sort(by_area.begin(), by_area.end(), [&](std::uint32_t a, std::uint32_t b) {
    return grower.facets()[a].area_m2 > grower.facets()[b].area_m2;
  });
  for (const std::uint32_t seed : by_area) {
    if (grower.pieces()[seed] == kFree) grower.grow(seed, out.count++, options.cone_rad);
  }
  out.triangle_piece = grower.pieces();
  return out;
}

double worst_concavity_m(const TriangleMesh& mesh, const ConvexPieces& pieces) {
  const std::vector<Facet> facets = facets_of(mesh);
  std::vector<std::vector<std::uint32_t>> members(pieces.count);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) members[pieces.triangle_piece[t]].push_back(t);
  double worst_m = 0;
  for (const auto& piece : members) {
    for (const std::uint32_t t : piece) {
      for (const std::uint32_t other : piece) {
        for (const std::uint32_t v : mesh.triangles[other]) {
          worst_m = std::max(worst_m, glm::dot(facets[t].normal, mesh.positions_O[v]) - facets[t].offset_m);
        }
      }
    }
  }
  return worst_m;
}

}  // namespace farfeel::slave_sim
