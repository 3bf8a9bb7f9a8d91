// A vector, cut to a length.
#pragma once

#include <glm/glm.hpp>

namespace farfeel::spatial {

/// v, or what points the same way and is as long as most. Precondition: most >= 0. What is not finite stays so.
[[nodiscard]] inline glm::dvec3 no_longer_than(double most, const glm::dvec3& v) noexcept {
  const double length = glm::length(v);
  return length > most ? most / length * v : v;
}

}  // namespace farfeel::spatial
