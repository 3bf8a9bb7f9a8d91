// Hull vertices written in another object's frame, each piece when it is first needed after the pose has changed.
#pragma once

#include <cstdint>
#include <vector>

#include "haptic_core/collision/convex_pair.h"
#include "haptic_core/collision/convex_pieces.h"
#include "haptic_core/collision/hull_support.h"

namespace farfeel::collision {

class MovedVertices {
 public:
  explicit MovedVertices(const ConvexPieces& from) : from_(&from), written_at_(from.size()) {
    std::uint32_t numbers = 0;
    for (const ConvexPiece& piece : from.pieces) first_.push_back(numbers), numbers += 3 * piece.vertex_count;
    numbers_.resize(numbers);
  }

  void set_pose(const Placement& X) { X_ = X, ++now_; }
  [[nodiscard]] const Placement& pose() const { return X_; }

  [[nodiscard, gnu::always_inline]] HullVertices of(std::uint32_t piece) {
    const auto [u, v, w, count] = from_->vertices(piece);
    double *x = &numbers_[first_[piece]], *y = x + count, *z = y + count;
    if (written_at_[piece] != now_) {
      written_at_[piece] = now_;
      const glm::dmat3& R = X_.R;
      for (std::uint32_t k = 0; k < count; k += 4) {
        Four a, b, c;
        load_four(a, u + k), load_four(b, v + k), load_four(c, w + k);
        store_four(x + k, R[0].x * a + R[1].x * b + R[2].x * c + X_.p.x);
        store_four(y + k, R[0].y * a + R[1].y * b + R[2].y * c + X_.p.y);
        store_four(z + k, R[0].z * a + R[1].z * b + R[2].z * c + X_.p.z);
      }
    }
    return {x, y, z, count};
  }

 private:
  const ConvexPieces* from_;
  Placement X_;
  std::uint64_t now_ = 0;
  std::vector<double> numbers_;
  std::vector<std::uint32_t> first_;  ///< of a piece, in numbers_
  std::vector<std::uint64_t> written_at_;
};

}  // namespace farfeel::collision
