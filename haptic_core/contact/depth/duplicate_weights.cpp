// With x the way that tool and object went past each other since the last set, in kSettles_m, plus the time, in
// kSettles_s, sameness goes x / (1 + x) of what is left towards what it is at this pose. The shares are
//   s_i = min over j of 1 - shallower_ij A_ij,
// and shallower_ij + shallower_ji = 1: two that are one have the stiffness of one, however their depths compare.
#include "haptic_core/contact/depth/duplicate_weights.h"

#include <Eigen/Core>
#include <algorithm>
#include <utility>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/contact/depth/constants.h"
#include "haptic_core/contact/smooth_step.h"

namespace farfeel::contact {
namespace {

double sameness_of(const Contact& a, const Contact& b, double apart_m) {
  const double cosine = a.gradient.tail<3>().normalized().dot(b.gradient.tail<3>().normalized());
  const double alike = share_between(cosine, kUnlike, kAlike);
  if (!(alike > 0)) return 0;
  const double apart = smooth_step(2 * glm::distance(a.p_WC_W, b.p_WC_W) / apart_m - 1);
  return alike * (1 - apart);
}

}  // namespace

void DuplicateWeights::fade(ContactSet& set, const spatial::Pose& from_X_WT, const motion::MovingObjects& moving,
                            double dt_s) noexcept {
  if (ablated(Mechanism::kDuplicateWeights)) return;
  const spatial::Pose back_W = from_X_WT * spatial::inverse(set.X_WT);
  std::array<double, kMaxContacts> ways, shares;  // ways: of each point, in kSettles_m
  std::array<bool, kMaxContacts> did_press;
  known_.begin_answer();
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const Contact& a = set.contacts[i];
    glm::dvec3 from_W = spatial::transform_point(back_W, a.p_WC_W);
    if (const motion::Moved* moved = moving.find(a.object)) from_W = spatial::transform_point(moved->way_W, from_W);
    ways[i] = glm::distance(a.p_WC_W, from_W) / kSettles_m;
    shares[i] = 1;
    Known& known = known_.keep(a.id.number);
    did_press[i] = std::exchange(known.presses, a.depth_m > 0);
  }
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const Contact& a = set.contacts[i];
    Known& known = known_.keep(a.id.number);
    for (std::uint32_t j = 0; j < set.count; ++j) {
      const Contact& b = set.contacts[j];
      if (i == j || a.object != b.object) continue;
      float& last = known.sameness[PerTrack<Known>::slot_of(b.id.number)];
      float sameness = static_cast<float>(sameness_of(a, b, apart_m_));
      if (did_press[i] && did_press[j]) {
        const double x = std::max(ways[i], ways[j]) + dt_s / kSettles_s;
        sameness = last + static_cast<float>(x / (1 + x)) * (sameness - last);
      }
      last = sameness;
      const double shallower = smooth_step(0.5 + 0.5 * (b.depth_m - a.depth_m) / kAsDeep_m);
      shares[i] = std::min(shares[i], 1 - shallower * static_cast<double>(sameness));
    }
  }
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < set.count; ++i) {
    if (!(shares[i] > kLeastShare)) continue;
    if (kept != i) set.contacts[kept] = set.contacts[i];
    set.contacts[kept].material.stiffness_N_per_m *= shares[i];
    set.contacts[kept].material.damping_Ns_per_m *= shares[i];
    ++kept;
  }
  set.count = kept;
}

}  // namespace farfeel::contact
