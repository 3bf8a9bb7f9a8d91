#include "haptic_core/contact/depth/points/stacked_pieces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "haptic_core/contact/depth/points/constants.h"

namespace farfeel::contact {
namespace {

struct Face {
  std::array<glm::dvec3, 3> corners;
  glm::dvec3 n, low, high;
  std::uint32_t piece;
};

bool is_over(const Face& face, const glm::dvec3& p) {
  for (std::size_t e = 0; e < 3; ++e) {
    const glm::dvec3 &a = face.corners[e], &b = face.corners[(e + 1) % 3];
    if (glm::dot(glm::cross(b - a, p - a), face.n) < 0) return false;
  }
  return true;
}

/// Whether between p and its foot there is an underside: a face that looks against d. Without one the two are one
/// layer, however it is folded.
bool is_undercut(const std::vector<Face>& faces, const glm::dvec3& p, const glm::dvec3& foot, const glm::dvec3& d) {
  for (const Face& face : faces) {
    const double against = glm::dot(face.n, d);
    if (!(against < 0)) continue;
    const double along = glm::dot(face.corners[0] - foot, face.n) / against, all = glm::dot(p - foot, d);
    if (along <= std::min(0.0, all) || along >= std::max(0.0, all)) continue;
    if (is_over(face, foot + along * d)) return true;
  }
  return false;
}

/// Whether some of the other face lies over or under this one along d, in another layer.
bool hides(const std::vector<Face>& faces, const Face& face, const Face& other, const glm::dvec3& d, double reach_m) {
  // The middle, and points near the corners.
  const glm::dvec3 middle = (other.corners[0] + other.corners[1] + other.corners[2]) / 3.0;
  for (std::size_t k = 0; k < 4; ++k) {
    const glm::dvec3 p = k == 3 ? middle : glm::mix(middle, other.corners[k], 0.9);
    const double up_m = glm::dot(p - face.corners[0], face.n) / glm::dot(d, face.n);
    if (!(std::abs(up_m) > kLeastApart_m) || std::abs(up_m) > reach_m) continue;
    const glm::dvec3 foot = p - up_m * d;
    if (is_over(face, foot) && is_undercut(faces, p, foot, d)) return true;
  }
  return false;
}

}  // namespace

StackedPieces::StackedPieces(const geometry::HapticSurface& surface, double reach_m) {
  std::vector<Face> faces;
  faces.reserve(surface.coarse.triangles.size());
  for (std::size_t i = 0; i < surface.coarse.triangles.size(); ++i) {
    const geometry::Triangle& t = surface.coarse.triangles[i];
    const auto& p = surface.coarse.positions_O;
    Face face{{p[t[0]], p[t[1]], p[t[2]]}, geometry::unit_normal(surface.coarse, t), {}, {}, surface.triangle_piece[i]};
    face.low = glm::min(glm::min(face.corners[0], face.corners[1]), face.corners[2]) - 0.5 * reach_m;
    face.high = glm::max(glm::max(face.corners[0], face.corners[1]), face.corners[2]) + 0.5 * reach_m;
    faces.push_back(face);
  }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.low.x < b.low.x; });
  std::vector<std::pair<std::uint32_t, std::uint32_t>> stacked;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const Face& a = faces[i];
    for (std::size_t j = i + 1; j < faces.size() && faces[j].low.x <= a.high.x; ++j) {
      const Face& b = faces[j];
      if (a.piece == b.piece || glm::dot(a.n, b.n) < kFacing) continue;
      if (glm::any(glm::greaterThan(b.low, a.high)) || glm::any(glm::greaterThan(a.low, b.high))) continue;
      const glm::dvec3 d = glm::normalize(a.n + b.n);
      if (!hides(faces, a, b, d, reach_m) && !hides(faces, b, a, d, reach_m)) continue;
      stacked.emplace_back(a.piece, b.piece);
      stacked.emplace_back(b.piece, a.piece);
    }
  }
  std::sort(stacked.begin(), stacked.end());
  stacked.erase(std::unique(stacked.begin(), stacked.end()), stacked.end());
  start_.assign(surface.piece_count + 1, 0);
  for (const auto& [piece, other] : stacked) ++start_[piece + 1], others_.push_back(other);
  for (std::size_t piece = 0; piece < surface.piece_count; ++piece) start_[piece + 1] += start_[piece];
}

}  // namespace farfeel::contact
