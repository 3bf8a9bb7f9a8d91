// With c a cube's middle, r half its diagonal, d_f(c) the distance of triangle f and e_f what its relief adds or takes:
// the felt place of f is no nearer to any point of the cube than d_f - e_f - r, and that of some g is no farther than
// d_g + e_g + r. Where the first is more than twice the least of the second, f is out. A cube's parts inherit its list.
#include "haptic_core/contact/depth/points/nearest_facets.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <utility>

#include "haptic_core/contact/depth/points/constants.h"

namespace farfeel::contact {
namespace {

struct Cube {
  std::uint32_t cell, level;
  glm::dvec3 low;
  std::vector<std::uint32_t> facets;
};

}  // namespace

NearestFacets::NearestFacets(const FacetedSurface& surface, double above_m, double below_m, double around_m)
    : around_m_(around_m) {
  glm::dvec3 low{std::numeric_limits<double>::infinity()}, high = -low;
  std::vector<std::uint32_t> all(surface.size());
  for (std::uint32_t i = 0; i < surface.size(); ++i) {
    all[i] = i;
    for (const glm::dvec3& corner : surface.facet(i).corners_O)
      low = glm::min(low, corner), high = glm::max(high, corner);
  }
  cells_.emplace_back();
  if (all.empty()) {
    cells_[0].least_m = std::numeric_limits<float>::max();
    return;
  }
  beyond_m_ = above_m + surface.most_relief_m() + around_m;
  const glm::dvec3 size = high - low + 2 * beyond_m_;
  side_m_ = std::max({size.x, size.y, size.z});
  low_O_ = low - beyond_m_;
  // Level by level, so that where the number of cells ends they are all about as large.
  std::vector<Cube> cubes{{0, 0, low_O_, std::move(all)}};
  std::vector<double> distances_m;
  for (std::size_t next = 0; next < cubes.size(); ++next) {
    Cube cube = std::move(cubes[next]);
    const double side_m = std::ldexp(side_m_, -static_cast<int>(cube.level)),
                 reach_m = 0.5 * std::sqrt(3.0) * side_m + around_m;
    const glm::dvec3 centre = cube.low + 0.5 * side_m;
    distances_m.clear();
    double farthest_m = std::numeric_limits<double>::infinity(), nearest_m = farthest_m, told = farthest_m, side_of = 0;
    for (const std::uint32_t i : cube.facets) {
      const FlatDistance at = surface.facet(i).distance(centre);
      const double d_m = std::sqrt(at.square_m2()), e_m = surface.relief_m(i);
      distances_m.push_back(d_m);
      farthest_m = std::min(farthest_m, d_m + e_m);
      nearest_m = std::min(nearest_m, d_m - e_m);
      const double square = at.square_m2() - kPrefersSquare * at.above_m * at.above_m;
      if (square < told) told = square, side_of = at.above_m;
    }
    Cell& cell = cells_[cube.cell];
    cell.is_beneath = side_of < 0;
    if (nearest_m - reach_m > (cell.is_beneath ? below_m : above_m)) {
      cell.least_m = static_cast<float>(nearest_m - reach_m);
      continue;
    }
    const double most_m = std::max(kAll_m, kFarther * (farthest_m + reach_m));
    std::vector<std::uint32_t> kept;
    std::vector<std::pair<double, std::uint32_t>> order;
    for (std::size_t k = 0; k < cube.facets.size(); ++k) {
      const std::uint32_t i = cube.facets[k];
      if (distances_m[k] - surface.relief_m(i) - reach_m > most_m) continue;
      order.emplace_back(distances_m[k], i);
    }
    std::sort(order.begin(), order.end());
    for (const auto& [d_m, i] : order) kept.push_back(i);
    const bool is_done = kept.size() <= kFew || side_m <= std::max(kLeastSide_m, surface.most_relief_m()) ||
                         cube.level == kDeepestCube || cells_.size() + 8 > kMostCells;
    if (is_done) {
      const std::size_t room = kMostFacets - std::min(kMostFacets, facets_.size());
      cell.first = static_cast<std::uint32_t>(facets_.size());
      cell.count = static_cast<std::uint16_t>(std::min<std::size_t>({kept.size(), room, 0xFFFF}));
      facets_.insert(facets_.end(), kept.begin(), kept.begin() + cell.count);
      continue;
    }
    cell.is_parted = true;
    cell.first = static_cast<std::uint32_t>(cells_.size());
    for (std::uint32_t part = 0; part < 8; ++part) {
      const glm::dvec3 offset{part & 1, part >> 1 & 1, part >> 2};
      cubes.push_back(
          {static_cast<std::uint32_t>(cells_.size()), cube.level + 1, cube.low + 0.5 * side_m * offset, kept});
      cells_.emplace_back();  // `cell` is no more
    }
  }
  cells_.shrink_to_fit();
  facets_.shrink_to_fit();
}

std::shared_ptr<const NearestFacets> NearestFacets::shared(const FacetedSurface& surface, double above_m,
                                                           double below_m, double around_m) {
  // All that the constructor looks at: equal numbers make equal trees.
  std::vector<double> key{above_m, below_m, around_m, surface.most_relief_m()};
  for (std::uint32_t i = 0; i < surface.size(); ++i) {
    for (const glm::dvec3& corner : surface.facet(i).corners_O) key.insert(key.end(), {corner.x, corner.y, corner.z});
    key.push_back(surface.relief_m(i));
  }
  static std::mutex mutex;
  static std::map<std::vector<double>, std::weak_ptr<const NearestFacets>> made;
  const std::lock_guard lock(mutex);
  std::erase_if(made, [](const auto& one) { return one.second.expired(); });
  std::weak_ptr<const NearestFacets>& known = made[std::move(key)];
  auto tree = known.lock();
  if (!tree) known = tree = std::make_shared<const NearestFacets>(surface, above_m, below_m, around_m);
  return tree;
}

NearestFacets::Near NearestFacets::near(const glm::dvec3& p_O) const noexcept {
  glm::dvec3 x = (p_O - low_O_) / side_m_;
  if (!(x.x >= 0 && x.y >= 0 && x.z >= 0 && x.x < 1 && x.y < 1 && x.z < 1)) {
    const glm::dvec3 out = side_m_ * glm::max(glm::max(-x, x - 1.0), glm::dvec3{0});
    return {{}, beyond_m_ - around_m_ + glm::length(out), false};
  }
  const Cell* cell = &cells_[0];
  while (cell->is_parted) {
    x *= 2.0;
    const glm::dvec3 part{x.x >= 1, x.y >= 1, x.z >= 1};
    x -= part;
    cell = &cells_[cell->first + static_cast<std::uint32_t>(part.x + 2 * part.y + 4 * part.z)];
  }
  return {{facets_.data() + cell->first, cell->count}, cell->least_m, cell->is_beneath};
}

}  // namespace farfeel::contact
