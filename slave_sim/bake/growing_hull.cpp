// A vertex outside the hull sees some of its faces. They go, and the edges round them, each of which only one of its
// two faces is seen of, get new faces with the vertex.
#include "slave_sim/bake/growing_hull.h"

#include <algorithm>
#include <random>

namespace farfeel::slave_sim {

using geometry::Triangle;

GrowingHull::GrowingHull(const geometry::TriangleMesh& mesh) : moved_O_(mesh.positions_O) {
  constexpr double kMoved = 1e-7;  // of the mesh's size: far above rounding, far below what is looked for
  if (mesh.positions_O.empty()) return;
  const double most_m = kMoved * glm::length(geometry::bounding_box(mesh).size());
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> move(-most_m, most_m);
  for (glm::dvec3& p : moved_O_) {
    const double x = move(random), y = move(random), z = move(random);
    p += glm::dvec3(x, y, z);
  }
}

void GrowingHull::start(const Triangle& t) {
  faces_ = {t, {t[2], t[1], t[0]}};
}

bool GrowingHull::sees(std::uint32_t vertex, const Triangle& face) const {
  const glm::dvec3& a = moved_O_[face[0]];
  return glm::dot(glm::cross(moved_O_[face[1]] - a, moved_O_[face[2]] - a), moved_O_[vertex] - a) > 0;
}

const std::vector<Triangle>& GrowingHull::faces_with(std::uint32_t vertex) {
  added_.clear(), border_.clear();
  is_seen_.assign(faces_.size(), false);
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const Triangle& f = faces_[i];
    if (std::find(f.begin(), f.end(), vertex) != f.end()) {  // is a corner already
      is_seen_.assign(faces_.size(), false), border_.clear();
      return added_;
    }
    is_seen_[i] = sees(vertex, f);
    if (!is_seen_[i]) continue;
    for (std::size_t k = 0; k < 3; ++k) border_.emplace_back(f[k], f[(k + 1) % 3]);
  }
  for (const auto& [from, to] : border_) {
    if (std::find(border_.begin(), border_.end(), std::pair(to, from)) == border_.end())
      added_.push_back({from, to, vertex});
  }
  return added_;
}

void GrowingHull::take(std::uint32_t vertex) {
  if (faces_with(vertex).empty()) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    if (!is_seen_[i]) faces_[kept++] = faces_[i];
  }
  faces_.resize(kept);
  faces_.insert(faces_.end(), added_.begin(), added_.end());
}

}  // namespace farfeel::slave_sim
