// A depth that is moved on with the tool by its gradient, instead of being searched again.
//
// Kept in S: depth, gradient g and T's pose at the search. With d how far To has moved in S since, and theta how T has
// turned,
//   depth = depth_then + g_rotation . theta + g_translation . d,
// and the contact point rides on T. What is left out grows with the depth's curvature times half the square of the way:
// 0.1 um rms at 0.1 m/s and 4 kHz over ridges of 1.5 mm.
#pragma once

#include <cstdint>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::contact {

class Extrapolation {
 public:
  void begin(const penetration::Query& query, const penetration::Penetration& answer) noexcept {
    contact_ = query.contact, s_ = query.s.surface, t_ = query.t.surface;
    X_ST_ = spatial::inverse(query.s.X_CO) * query.t.X_CO;
    p_TQ_ = spatial::transform_point(spatial::inverse(query.t.X_CO), answer.p_CQ_C);
    const spatial::Wrench g_C = spatial::wrench_from(answer.gradient);
    turning_S_ = spatial::rotate_back(query.s.X_CO, g_C.torque_Nm);
    moving_S_ = spatial::rotate_back(query.s.X_CO, g_C.force_N);
    found_ = answer;
  }
  /// Whether it began with a known depth of this contact, between these surfaces.
  [[nodiscard]] bool is_of(const penetration::Query& query) const noexcept {
    return query.contact != 0 && contact_ == query.contact && s_ == query.s.surface && t_ == query.t.surface &&
           found_.is_known();
  }
  /// How far the contact point has gone since [m]. Precondition: is_of(query), as below.
  [[nodiscard]] double way_m(const penetration::Query& query) const noexcept {
    return glm::distance(spatial::transform_point(query.t.X_CO, p_TQ_),
                         spatial::transform_point(query.s.X_CO * X_ST_, p_TQ_));
  }
  [[nodiscard]] penetration::Penetration at(const penetration::Query& query) const noexcept {
    const spatial::Pose now = spatial::inverse(query.s.X_CO) * query.t.X_CO;
    const glm::dvec3 turned_S = spatial::vector_from_rotation(now.R * glm::conjugate(X_ST_.R));
    penetration::Penetration answer = found_;
    answer.depth_m += glm::dot(turning_S_, turned_S) + glm::dot(moving_S_, now.p - X_ST_.p);
    answer.gradient = spatial::to_vector6(
        spatial::Wrench{spatial::rotate(query.s.X_CO, turning_S_), spatial::rotate(query.s.X_CO, moving_S_)});
    answer.p_CQ_C = spatial::transform_point(query.t.X_CO, p_TQ_);
    return answer;
  }

 private:
  std::uint32_t contact_ = 0;
  const penetration::FeltSurface *s_ = nullptr, *t_ = nullptr;
  spatial::Pose X_ST_;                               // then
  glm::dvec3 p_TQ_{0}, turning_S_{0}, moving_S_{0};  // contact point; the gradient's halves
  penetration::Penetration found_;
};

}  // namespace farfeel::contact
