// Solid noise of a stated band and strength, closed-form: the roughness of cast and hammered surfaces.
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace farfeel::slave_sim {

struct Roughness {
  double rms_m, shortest_m, longest_m;  ///< > 0, shortest < longest
};

/// A sum of 48 plane waves whose projections on all three axis planes are in the band, so that faces across any axis
/// carry only those wavelengths.
class SolidNoise {
 public:
  explicit SolidNoise(const Roughness&);
  [[nodiscard]] double height_m(const glm::dvec3& p_m) const;

 private:
  struct Wave {
    glm::dvec3 k_1_per_m;
    double phase;
  };
  std::vector<Wave> waves_;
  double amplitude_m_;
};

}  // namespace farfeel::slave_sim
