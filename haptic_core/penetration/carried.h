// An answer that is carried along with the tool instead of being searched again.
//
// Kept in S: depth, gradient g and T's pose then. With d how far To has moved in S since, and theta how T has turned,
//   depth = depth_then + g_rotation . theta + g_translation . d,
// and the contact point rides on T.
#pragma once

#include <cstdint>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::penetration {

class Carried {
 public:
  void keep(const Query& query, const Penetration& answer) noexcept {
    contact_ = query.contact, s_ = query.s.surface, t_ = query.t.surface;
    X_ST_ = spatial::inverse(query.s.X_CO) * query.t.X_CO;
    p_TQ_ = spatial::transform_point(spatial::inverse(query.t.X_CO), answer.p_CQ_C);
    const spatial::Wrench g_C = spatial::wrench_from(answer.gradient);
    turning_S_ = spatial::rotate_back(query.s.X_CO, g_C.torque_Nm);
    moving_S_ = spatial::rotate_back(query.s.X_CO, g_C.force_N);
    found_ = answer;
  }
  /// Whether it was kept for this contact, and known.
  [[nodiscard]] bool is_of(const Query& query) const noexcept {
    return query.contact != 0 && contact_ == query.contact && s_ == query.s.surface && t_ == query.t.surface &&
           found_.is_known();
  }
  /// How far the contact point has gone since [m]. Precondition: is_of(query), as below.
  [[nodiscard]] double way_m(const Query& query) const noexcept {
    return glm::distance(spatial::transform_point(query.t.X_CO, p_TQ_),
                         spatial::transform_point(query.s.X_CO * X_ST_, p_TQ_));
  }
  [[nodiscard]] Penetration carried_to(const Query& query) const noexcept {
    const spatial::Pose now = spatial::inverse(query.s.X_CO) * query.t.X_CO;
    const glm::dvec3 turned_S = spatial::vector_from_rotation(now.R * glm::conjugate(X_ST_.R));
    Penetration answer = found_;
    answer.depth_m += glm::dot(turning_S_, turned_S) + glm::dot(moving_S_, now.p - X_ST_.p);
    answer.gradient = spatial::to_vector6(
        spatial::Wrench{spatial::rotate(query.s.X_CO, turning_S_), spatial::rotate(query.s.X_CO, moving_S_)});
    answer.p_CQ_C = spatial::transform_point(query.t.X_CO, p_TQ_);
    return answer;
  }

 private:
  std::uint32_t contact_ = 0;
  const FeltSurface *s_ = nullptr, *t_ = nullptr;
  spatial::Pose X_ST_;                               // then
  glm::dvec3 p_TQ_{0}, turning_S_{0}, moving_S_{0};  // contact point; the gradient's halves
  Penetration found_;
};

}  // namespace farfeel::penetration
