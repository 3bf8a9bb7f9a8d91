#include "haptic_core/contact/crossed_sheets.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "haptic_core/collision/hull_support.h"

namespace farfeel::contact {
namespace {

using collision::ConvexPieces;
using collision::HullVertices;
using collision::ProximityPair;

/// Cosines' product from which a pair begins to count as crossed. Beside an edge the direction tilts away from the
/// sheets' normals: there, nothing has passed through.
constexpr double kSquareFrom = 0.9;

/// How far along the unit direction d a ray from p leaves the mesh through a triangle, if it meets this one.
std::optional<double> leaves_at_m(const geometry::TriangleMesh& mesh, const geometry::Triangle& t, const glm::dvec3& p,
                                  const glm::dvec3& d) {
  const glm::dvec3 &a = mesh.positions_O[t[0]], e1 = mesh.positions_O[t[1]] - a, e2 = mesh.positions_O[t[2]] - a;
  const double det = glm::dot(glm::cross(e1, e2), d);
  if (!(det > 0)) return {};  // faces the ray, or lies along it
  const glm::dvec3 from_a = p - a;
  const glm::dvec3 q = glm::cross(from_a, d);
  const double u = -glm::dot(e2, q) / det, v = glm::dot(e1, q) / det;
  if (u < 0 || v < 0 || u + v > 1) return {};
  return -glm::dot(glm::cross(e1, e2), from_a) / det;
}

}  // namespace

std::vector<double> material_behind_m(const geometry::HapticSurface& surface) {
  const geometry::TriangleMesh& mesh = surface.coarse;
  std::vector<double> least_m(surface.piece_count, std::numeric_limits<double>::infinity());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const geometry::Triangle& v = mesh.triangles[t];
    const glm::dvec3 middle = (mesh.positions_O[v[0]] + mesh.positions_O[v[1]] + mesh.positions_O[v[2]]) / 3.0;
    const glm::dvec3 inwards = -geometry::unit_normal(mesh, v);
    double& least = least_m[surface.triangle_piece[t]];
    for (std::size_t other = 0; other < mesh.triangles.size(); ++other) {
      if (other == t) continue;
      const auto at_m = leaves_at_m(mesh, mesh.triangles[other], middle, inwards);
      if (at_m && *at_m > 0) least = std::min(least, *at_m);
    }
  }
  for (double& least : least_m) {
    if (!(least < std::numeric_limits<double>::infinity())) least = 0;
  }
  return least_m;
}

CrossedSheets::CrossedSheets(const geometry::HapticSurface& S, const collision::HullTree& tree_s,
                             const geometry::HapticSurface& T, const collision::HullTree& tree_t)
    : s_(&tree_s.pieces()),
      t_(&tree_t.pieces()),
      material_s_m_(material_behind_m(S)),
      material_t_m_(material_behind_m(T)) {
  constexpr std::size_t kMostPairs = 16'384;  // as a proximity query reports
  mended_.reserve(std::min<std::size_t>(std::size_t{s_->size()} * t_->size(), kMostPairs));
}

std::span<const ProximityPair> CrossedSheets::mended(std::span<const ProximityPair> pairs, double tolerance_m,
                                                     const spatial::Pose& X_ST) noexcept {
  bool has_any = false;
  const glm::dmat3 R_ST = glm::mat3_cast(X_ST.R);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const ProximityPair& pair = pairs[i];
    if (pair.is_admissible || !(pair.distance_m > 0)) continue;
    if (pair.distance_m > std::max(material_s_m_[pair.piece_s], material_t_m_[pair.piece_t])) continue;
    const HullVertices outwards_s = s_->outwards(pair.piece_s), outwards_t = t_->outwards(pair.piece_t);
    if (outwards_s.count == 0 || outwards_t.count == 0) continue;  // one that faces every way has no behind
    const glm::dvec3 u_S = -pair.nhat_ST_S, u_T = u_S * R_ST;
    const double square = std::max(0.0, collision::outwardness(outwards_s, u_S)) *
                          std::max(0.0, collision::outwardness(outwards_t, -u_T));
    if (square <= kSquareFrom) continue;
    const double high_s_m = collision::reach_along(s_->vertices(pair.piece_s), u_S) + glm::dot(u_S, s_->centre_O);
    const double low_t_m = glm::dot(u_S, spatial::transform_point(X_ST, t_->centre_O)) -
                           collision::reach_along(t_->vertices(pair.piece_t), -u_T);
    if (high_s_m - low_t_m - pair.distance_m > tolerance_m) continue;  // too thick to have passed through
    if (!has_any) mended_.assign(pairs.begin(), pairs.end());
    has_any = true;
    ProximityPair& crossed = mended_[i];
    crossed.nhat_ST_S = u_S;
    crossed.distance_m = low_t_m - high_s_m;
    crossed.p_Ss_S += (high_s_m - glm::dot(u_S, pair.p_Ss_S)) * u_S;
    crossed.p_St_S += (low_t_m - glm::dot(u_S, pair.p_St_S)) * u_S;
    crossed.facing = (square - kSquareFrom) / (1 - kSquareFrom);
    crossed.is_admissible = true;
  }
  return has_any ? mended_ : pairs;
}

}  // namespace farfeel::contact
