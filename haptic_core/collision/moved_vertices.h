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
  explicit MovedVertices(const ConvexPieces& from)
      : from_(&from), x_(from.x), y_(from.y), z_(from.z), written_at_(from.size()) {}

  void set_pose(const Placement& X) { X_ = X, ++now_; }
  [[nodiscard]] const Placement& pose() const { return X_; }

  [[nodiscard, gnu::always_inline]] HullVertices of(std::uint32_t piece) {
    const std::uint32_t first = from_->pieces[piece].first_vertex, count = from_->pieces[piece].vertex_count;
    double *x = &x_[first], *y = &y_[first], *z = &z_[first];
    if (written_at_[piece] != now_) {
      written_at_[piece] = now_;
      const double *u = &from_->x[first], *v = &from_->y[first], *w = &from_->z[first];
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
  std::vector<double> x_, y_, z_;
  std::vector<std::uint64_t> written_at_;
};

}  // namespace farfeel::collision
