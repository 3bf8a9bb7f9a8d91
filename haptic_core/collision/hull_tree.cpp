#include "haptic_core/collision/hull_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace farfeel::collision {

HullTree::HullTree(ConvexPieces pieces) : pieces_(std::move(pieces)), order_(pieces_.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  nodes_.reserve(2 * order_.size());
  if (!order_.empty()) build(0, std::uint32_t(order_.size()));
}

void HullTree::build(std::uint32_t first, std::uint32_t count) {
  geometry::Box box, centres;
  const auto middle = [&](std::uint32_t p) { return pieces_.boxes[p].centre(); };
  for (std::uint32_t k = first; k < first + count; ++k) {
    box.include(pieces_.boxes[order_[k]].low), box.include(pieces_.boxes[order_[k]].high);
    centres.include(middle(order_[k]));
  }
  const std::size_t self = nodes_.size();
  const glm::dvec3 centre = box.centre(), half = 0.5 * box.size();
  nodes_.push_back({{centre.x, centre.y, centre.z, 0}, {half.x, half.y, half.z, 0}, first, count, 0});
  if (count == 1) return;
  const glm::dvec3 spread = centres.size();
  const int axis = spread.x >= spread.y && spread.x >= spread.z ? 0 : spread.y >= spread.z ? 1 : 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + count / 2, begin + count, [&](std::uint32_t p, std::uint32_t q) {
    return std::pair(middle(p)[axis], p) < std::pair(middle(q)[axis], q);
  });
  build(first, count / 2);
  nodes_[self].second_child = std::uint32_t(nodes_.size());
  build(first + count / 2, count - count / 2);
}

}  // namespace farfeel::collision
