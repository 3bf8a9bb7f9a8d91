// A binary tree over the convex pieces of one object.
#pragma once

#include <array>

#include "haptic_core/collision/convex_pieces.h"

namespace farfeel::collision {

/// A node holds the pieces order[first] ... order[first + count - 1]; a leaf holds one.
struct HullTreeNode {
  std::array<double, 4> centre, half;  ///< box of its pieces, along the object's axes, less ConvexPieces::centre_O [m];
                                       ///< the fourth number is 0
  std::uint32_t first, count;          ///< into HullTree::order
  std::uint32_t second_child;          ///< the first child follows its parent; unused in leaves
};

/// Built once; read by any number of threads.
class HullTree {
 public:
  /// Splits at the median along the longest side. Precondition: pieces.size() >= 1.
  explicit HullTree(ConvexPieces pieces);

  [[nodiscard]] const ConvexPieces& pieces() const { return pieces_; }
  [[nodiscard]] const std::vector<HullTreeNode>& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<std::uint32_t>& order() const { return order_; }

 private:
  void build(std::uint32_t first, std::uint32_t count);

  ConvexPieces pieces_;
  std::vector<HullTreeNode> nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace farfeel::collision
