// What was found in a mesh: how often, and where first.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>

namespace farfeel::slave_sim {

struct Found {
  std::size_t count = 0;
  glm::dvec3 first_O{0};
  void add(const glm::dvec3& p_O) {
    if (count++ == 0) first_O = p_O;
  }
};

}  // namespace farfeel::slave_sim
