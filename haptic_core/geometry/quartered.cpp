#include "haptic_core/geometry/quartered.h"

#include <algorithm>
#include <map>
#include <utility>

namespace farfeel::geometry {

TriangleMesh quartered(const TriangleMesh& mesh) {
  TriangleMesh out{mesh.positions_O, {}};
  out.triangles.reserve(4 * mesh.triangles.size());
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto next = static_cast<std::uint32_t>(out.positions_O.size());
    const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), next);
    if (is_new) out.positions_O.push_back(0.5 * (mesh.positions_O[a] + mesh.positions_O[b]));
    return at->second;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    out.triangles.insert(out.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return out;
}

}  // namespace farfeel::geometry
