// Friction rides on the contact point C. Between two answers the tool's point that is at C now has come from p_before,
// as the object saw it; what lies across the direction of that way stretches the friction's spring (friction.h).
#include "haptic_core/contact/wrench/wrench_stage.h"

#include "haptic_core/contact/penalty.h"

namespace farfeel::contact {
namespace {

bool has_friction(const Contact& contact) {
  return contact.depth_m > 0 && (contact.material.static_friction > 0 || contact.material.dynamic_friction > 0);
}

}  // namespace

void WrenchStage::add_friction(ContactSet& set, const Contact& contact, const spatial::Pose& from_X_WT,
                               const motion::MovingObjects& moving) noexcept {
  const bool is_new = frictions_.find(contact.id.number) == nullptr;
  Friction& friction = frictions_.keep(contact.id.number);
  ++count_;
  const FrictionLimits limits = friction_limits(contact.material, contact.material.stiffness_N_per_m * contact.depth_m);
  if (!is_new) {
    glm::dvec3 p_WC_before = spatial::transform_point(from_X_WT * spatial::inverse(set.X_WT), contact.p_WC_W);
    if (const motion::Moved* moved = moving.find(contact.object)) {  // as the object saw it
      p_WC_before = spatial::transform_point(moved->way_W, p_WC_before);
      friction.stretch_W = moved->way_W.R * friction.stretch_W;
    }
    const glm::dvec3 moved_W = contact.p_WC_W - p_WC_before;
    const glm::dvec3& n = contact.nhat_ST_W;
    turn_to(friction, n);
    slide(friction, limits, moved_W - glm::dot(moved_W, n) * n);
  }
  const glm::dvec3 force_W = -limits.stiffness_N_per_m * friction.stretch_W;
  set.F_To_W = set.F_To_W + spatial::Wrench{glm::cross(contact.p_WC_W - set.X_WT.p, force_W), force_W};
}

void WrenchStage::add(ContactSet& set, const spatial::Twist& V_WT_W, const spatial::Pose& from_X_WT,
                      const motion::MovingObjects& moving) noexcept {
  set.F_To_W = {};
  for (std::uint32_t i = 0; i < set.count; ++i) {
    spatial::Twist V_ST_W = V_WT_W;
    if (const motion::Moved* moved = moving.find(set.contacts[i].object)) {
      const spatial::Twist V_WS_W = moved->twist_at(set.X_WT.p);
      V_ST_W = {V_ST_W.angular_rad_s - V_WS_W.angular_rad_s, V_ST_W.linear_m_s - V_WS_W.linear_m_s};
    }
    set.F_To_W = set.F_To_W + penalty_wrench(set.contacts[i], V_ST_W);
  }
  frictions_.begin_answer();
  count_ = 0;
  for (std::uint32_t i = 0; i < set.count; ++i) {
    if (has_friction(set.contacts[i])) add_friction(set, set.contacts[i], from_X_WT, moving);
  }
}

}  // namespace farfeel::contact
