#include "slave_sim/bake/convex_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <span>
#include <unordered_map>

#include "slave_sim/bake/growing_hull.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

/// How finely hulls are looked at while a piece grows, and once it has grown. The least lengths are those of what a
/// tool of a millimetre could tell apart.
constexpr OwnSide::Fineness kGrowing{.share = 0.2, .least_m = 2e-4}, kGrown{.share = 0.04, .least_m = 1e-4};

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

Triangle sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

/// Calls on(face) for each face of the triangles' hull that is not one of theirs, while it returns true.
template <typename On>
void visit_lid(const TriangleMesh& mesh, GrowingHull& hull, std::span<const std::uint32_t> triangles, const On& on) {
  hull.start(mesh.triangles[triangles.front()]);
  std::vector<Triangle> own;
  for (const std::uint32_t t : triangles) {
    for (const std::uint32_t v : mesh.triangles[t]) hull.take(v);
    own.push_back(sorted(mesh.triangles[t]));
  }
  std::sort(own.begin(), own.end());
  for (const Triangle& face : hull.faces()) {
    if (!std::binary_search(own.begin(), own.end(), sorted(face)) && !on(face)) return;
  }
}

bool keeps_to_its_side(const TriangleMesh& mesh, OwnSide& own_side, GrowingHull& hull, Patch patch) {
  bool keeps = true;
  visit_lid(mesh, hull, patch, [&](const Triangle& face) { return keeps = own_side.allows(face, patch, kGrown); });
  return keeps;
}

class Grower {
 public:
  Grower(const TriangleMesh& mesh, const PieceOptions& options)
      : mesh_(mesh),
        facets_(facets_of(mesh)),
        neighbours_(triangle_neighbours(mesh)),
        own_side_(mesh, options.own_side_m),
        hull_(mesh),
        last_hull_(mesh),
        options_(options),
        piece_(mesh.triangles.size(), kFree),
        refused_(mesh.triangles.size(), 0) {}

  /// Grows a piece from the seed over free triangles.
  void grow(std::uint32_t seed, std::uint32_t piece) {
    ++growth_;
    begin(std::span(&seed, 1), piece);
    // What the new triangles are nearest to changes how deep old faces are, and growing looks coarsely: so in the end
    // the whole hull is looked at finely. Where it fails, it grows anew from the most triangles that pass, without the
    // next: until it has grown over as many triangles as there are in all. Hundreds of growths of a large patch that
    // always fails at the same place would take quarters of an hour for a few triangles more.
    const double most_regrown = options_.most_regrown * static_cast<double>(mesh_.triangles.size());
    for (double regrown = 0;;) {
      grow_on(piece);
      const std::vector<std::uint32_t> grown = triangles_;
      const std::size_t passing = most_that_keep_to_their_side();
      if (passing == grown.size()) return;
      for (const std::uint32_t t : grown) piece_[t] = kFree;
      begin(std::span(grown).first(passing), piece);
      if ((regrown += static_cast<double>(grown.size())) > most_regrown) return;
      refused_[grown[passing]] = growth_;
    }
  }

  void take_all(const std::vector<std::uint32_t>& triangles, std::uint32_t piece) {
    for (const std::uint32_t t : triangles) piece_[t] = piece;
  }

  [[nodiscard]] const std::vector<Facet>& facets() const { return facets_; }
  [[nodiscard]] const std::vector<Triangle>& neighbours() const { return neighbours_; }
  [[nodiscard]] const std::vector<std::uint32_t>& pieces() const { return piece_; }

 private:
  void begin(std::span<const std::uint32_t> triangles, std::uint32_t piece) {
    triangles_.clear(), vertices_.clear();
    normal_sum_ = glm::dvec3(0);
    hull_.start(mesh_.triangles[triangles.front()]);
    for (const std::uint32_t t : triangles) take(t, piece);
  }

  void grow_on(std::uint32_t piece) {
    for (std::uint32_t best = best_neighbour(piece); best != kFree; best = best_neighbour(piece)) {
      if (stays_convex(best) && stays_on_its_side(best)) {
        take(best, piece);
      } else {
        refused_[best] = growth_;  // what a patch refuses it refuses all the more when it has grown
      }
    }
  }

  void take(std::uint32_t t, std::uint32_t piece) {
    piece_[t] = piece;
    triangles_.push_back(t);
    normal_sum_ += facets_[t].area_m2 * facets_[t].normal;
    for (const std::uint32_t v : mesh_.triangles[t]) {
      if (std::find(vertices_.begin(), vertices_.end(), v) != vertices_.end()) continue;
      vertices_.push_back(v);
      hull_.take(v);
    }
  }

  /// The neighbour that agrees best with the piece so far: pieces stay compact and flat first. kFree if there is none.
  [[nodiscard]] std::uint32_t best_neighbour(std::uint32_t piece) const {
    std::uint32_t best = kFree;
    double best_score = -2;
    for (const std::uint32_t t : triangles_) {
      for (const std::uint32_t n : neighbours_[t]) {
        if (piece_[n] != kFree || refused_[n] == growth_) continue;
        const double score = agreement(n, piece);
        if (score > best_score && score >= std::cos(options_.cone_rad)) best = n, best_score = score;
      }
    }
    return best;
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
      if (height_m(v, facets_[added]) > options_.tolerance_m) return false;
    }
    for (const std::uint32_t v : mesh_.triangles[added]) {
      for (const std::uint32_t t : triangles_) {
        if (height_m(v, facets_[t]) > options_.tolerance_m) return false;
      }
    }
    return true;
  }

  /// Only the faces that the hull would get are looked at: the others were, when they came.
  [[nodiscard]] bool stays_on_its_side(std::uint32_t added) {
    triangles_.push_back(added);
    bool stays = true;
    for (const std::uint32_t v : mesh_.triangles[added]) {
      for (const Triangle& face : hull_.faces_with(v)) {
        stays =
            stays && (sorted(face) == sorted(mesh_.triangles[added]) || own_side_.allows(face, triangles_, kGrowing));
      }
    }
    triangles_.pop_back();
    return stays;
  }

  /// How many of the triangles, in the order they were taken, make a hull that passes the last look. Searched by
  /// halves, as if fewer always passed where more do; what is returned did pass.
  [[nodiscard]] std::size_t most_that_keep_to_their_side() {
    std::size_t passes = 1, fails = triangles_.size() + 1;  // a single one is its own hull
    for (std::size_t count = triangles_.size(); count > passes; count = (passes + fails) / 2) {
      const Patch patch = std::span(triangles_).first(count);
      (keeps_to_its_side(mesh_, own_side_, last_hull_, patch) ? passes : fails) = count;
    }
    return passes;
  }

  [[nodiscard]] double height_m(std::uint32_t vertex, const Facet& facet) const {
    return glm::dot(facet.normal, mesh_.positions_O[vertex]) - facet.offset_m;
  }

  const TriangleMesh& mesh_;
  std::vector<Facet> facets_;
  std::vector<Triangle> neighbours_;
  OwnSide own_side_;
  GrowingHull hull_, last_hull_;
  PieceOptions options_;
  std::vector<std::uint32_t> piece_;
  std::uint32_t growth_ = 0;                         ///< counts the pieces grown
  std::vector<std::uint32_t> refused_;               ///< per triangle: the growth that last did so
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
  std::vector<std::uint32_t> vertices;
  for (const std::uint32_t t : shell)
    vertices.insert(vertices.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return std::all_of(shell.begin(), shell.end(), [&](std::uint32_t t) {
    return std::none_of(vertices.begin(), vertices.end(), [&](std::uint32_t v) {
      return glm::dot(facets[t].normal, mesh.positions_O[v]) - facets[t].offset_m > tolerance_m;
    });
  });
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
    if (grower.pieces()[seed] == kFree) grower.grow(seed, out.count++);
  }

  out.triangle_piece = grower.pieces();
  return out;
}

codecs::HullBreaches hull_breaches(const TriangleMesh& mesh, const ConvexPieces& pieces, double tolerance_m) {
  constexpr std::size_t kPointsAVertex = 30, kMostPoints = 3000;
  OwnSide own_side(mesh, tolerance_m);
  std::vector<std::vector<std::uint32_t>> corners(pieces.count), members(pieces.count);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    auto& of = corners[pieces.triangle_piece[t]];
    of.insert(of.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
    members[pieces.triangle_piece[t]].push_back(t);
  }
  std::mt19937_64 random(1);
  std::exponential_distribution<double> weight(1);  // normalised: evenly spread over the simplex
  codecs::HullBreaches out;
  for (std::uint32_t piece = 0; piece < pieces.count; ++piece) {
    auto& of = corners[piece];
    std::sort(of.begin(), of.end());
    of.erase(std::unique(of.begin(), of.end()), of.end());
    std::uniform_int_distribution<std::size_t> any(0, of.size() - 1);
    Breach worst;
    for (std::size_t n = 0; n < std::min(kPointsAVertex * of.size(), kMostPoints); ++n) {
      glm::dvec3 sum(0);
      double weights = 0;
      for (std::size_t k = 0; k < 2 + n % 3; ++k) {
        const double w = weight(random);
        sum += w * mesh.positions_O[of[any(random)]], weights += w;
      }
      const Breach at = own_side.breach(sum / weights, members[piece]);
      worst.outside_m = std::max(worst.outside_m, at.outside_m);
      worst.past_middle_m = std::max(worst.past_middle_m, at.past_middle_m);
    }
    out.outside += worst.outside_m > tolerance_m ? 1 : 0;
    out.past_middle += worst.past_middle_m > tolerance_m ? 1 : 0;
    out.worst_outside_m = std::max(out.worst_outside_m, worst.outside_m);
    out.worst_past_middle_m = std::max(out.worst_past_middle_m, worst.past_middle_m);
  }
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
