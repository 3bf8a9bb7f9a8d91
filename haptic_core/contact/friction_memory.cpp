#include "haptic_core/contact/friction_memory.h"

#include <algorithm>

#include "haptic_core/contact/handover.h"

namespace farfeel::contact {

void FrictionMemory::add(ContactSet& set, const spatial::Pose& from_X_WT,
                         const motion::MovingObjects& moving) noexcept {
  std::array<Entry, kMaxContacts> now;
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const Contact& contact = set.contacts[i];
    if (!(contact.depth_m > 0) || !(contact.material.static_friction > 0 || contact.material.dynamic_friction > 0))
      continue;
    const auto of_id = [&](std::uint32_t id) {
      return std::find_if(entries_.begin(), entries_.begin() + count_,
                          [id](const Entry& entry) { return entry.id == id; });
    };
    const Entry* known = of_id(contact.id);
    if (known == entries_.begin() + count_ && (contact.id & kLeaves) != 0) known = of_id(contact.id & ~kLeaves);
    Entry& entry = now[count++];
    entry = {contact.id, {}};
    const FrictionLimits limits =
        friction_limits(contact.material, contact.material.stiffness_N_per_m * contact.depth_m);
    if (known != entries_.begin() + count_) {
      entry.friction = known->friction;
      glm::dvec3 p_WC_before = spatial::transform_point(from_X_WT * spatial::inverse(set.X_WT), contact.p_WC_W);
      if (const motion::Moved* moved = moving.find(contact.object)) {  // as the object saw it
        p_WC_before = spatial::transform_point(moved->way_W, p_WC_before);
        entry.friction.stretch_W = moved->way_W.R * entry.friction.stretch_W;
      }
      const glm::dvec3 moved_W = contact.p_WC_W - p_WC_before;
      const glm::dvec3& n = contact.nhat_ST_W;
      turn_to(entry.friction, n);
      slide(entry.friction, limits, moved_W - glm::dot(moved_W, n) * n);
    }
    const glm::dvec3 force_W = -limits.stiffness_N_per_m * entry.friction.stretch_W;
    set.F_To_W = set.F_To_W + spatial::Wrench{glm::cross(contact.p_WC_W - set.X_WT.p, force_W), force_W};
  }
  entries_ = now;
  count_ = count;
}

}  // namespace farfeel::contact
