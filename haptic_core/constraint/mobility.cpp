#include "haptic_core/constraint/mobility.h"

#include <Eigen/LU>

namespace farfeel::constraint {

using spatial::Vector6;

Mobility mobility(const tool::LinearStep& step) noexcept {
  const spatial::Matrix6 inverse = step.A.partialPivLu().inverse();
  return {step.V_begun, step.V_begun + step.share * (inverse * step.impulse), step.share * step.dt_s * inverse,
          step.dt_s};
}

Vector6 way_between(const spatial::Pose& from, const spatial::Pose& to) noexcept {
  Vector6 way;
  way << spatial::to_eigen(spatial::vector_from_rotation(to.R * glm::conjugate(from.R))),
      spatial::to_eigen(to.p - from.p);
  return way;
}

}  // namespace farfeel::constraint
