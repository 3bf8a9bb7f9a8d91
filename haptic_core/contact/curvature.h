// The second derivative of a contact's depth, small enough to travel with every contact.
#pragma once

#include <array>
#include <cstddef>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

/// Symmetric, in the coordinates of Contact::gradient: d^2 depth / d (rotation, translation) of T about To, in W.
struct Curvature {
  static constexpr std::size_t kEntries = 21;
  std::array<float, kEntries> upper{};  ///< row by row, from the diagonal on
  bool is_known = false;                ///< asked for, and the depth has one

  [[nodiscard]] static Curvature of(const spatial::Matrix6& hessian) noexcept {
    Curvature curvature{.upper = {}, .is_known = true};
    std::size_t k = 0;
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j) curvature.upper[k++] = static_cast<float>(hessian(i, j));
    return curvature;
  }
  [[nodiscard]] spatial::Matrix6 matrix() const noexcept {
    spatial::Matrix6 hessian;
    std::size_t k = 0;
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j) hessian(i, j) = hessian(j, i) = static_cast<double>(upper[k++]);
    return hessian;
  }
};

}  // namespace farfeel::contact
