#include "haptic_core/local_model/match.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/local_model/constants.h"

namespace farfeel::local_model {
namespace {

bool resists_like(const FeltContact& old, const FeltContact& now) {
  return now.stiffness_N_per_m() >= kLeastStiffnessLeft * old.stiffness_N_per_m();
}

/// Whether one may go on as the other, names apart.
bool is_alike(const FeltContact& old, const FeltContact& now) {
  const ReceivedContact &was = old.received, &is = now.received;
  return !old.transition.is_leaving && old.transition.share == 1 && was.contact.object == is.contact.object &&
         was.is_from_tiles() == is.is_from_tiles() && was.is_from_outline() == is.is_from_outline() &&
         resists_like(old, now) && glm::dot(was.contact.nhat_ST_W, is.contact.nhat_ST_W) > kSameSideCosine;
}

bool is_same(const FeltContact& old, const FeltContact& now) {
  return is_alike(old, now) && old.received.contact.id == now.received.contact.id;
}

bool is_renamed_same(const FeltContact& old, const FeltContact& now, bool is_alone) {
  if (ablated(Mechanism::kRenamed)) return false;
  if (!now.received.is_from_tiles() || !is_alike(old, now)) return false;
  return glm::distance(old.received.contact.p_WC_W, now.received.contact.p_WC_W) < kRenamedRange_m ||
         (is_alone && std::abs(old.here.depth_m - now.here.depth_m) < kRenamedDepth_m);
}

}  // namespace

Match match(std::span<const FeltContact> felt, std::span<const FeltContact> arriving,
            std::span<const std::size_t> stays_as) noexcept {
  Match match;
  match.successor.fill(kNoContact);
  for (std::size_t j = 0; j < arriving.size(); ++j)
    if (stays_as[j] != kNoContact) match.stays[stays_as[j]] = match.is_old[j] = true;
  const bool is_alone = arriving.size() == 1 && std::count_if(felt.begin(), felt.end(), [](const FeltContact& old) {
                                                  return !old.transition.is_leaving;
                                                }) == 1;
  for (const bool is_renamed : {false, true}) {
    for (std::size_t j = 0; j < arriving.size(); ++j) {
      if (arriving[j].received.origin.source == Source::kNewRemote) continue;
      for (std::size_t i = 0; i < felt.size() && !match.is_old[j]; ++i) {
        if (match.stays[i] ||
            !(is_renamed ? is_renamed_same(felt[i], arriving[j], is_alone) : is_same(felt[i], arriving[j])))
          continue;
        match.goes_on[match.goes_on_count++] = {i, j};
        match.stays[i] = match.is_old[j] = true;
      }
    }
  }

  std::array<bool, contact::kMaxContacts> has_past = match.is_old;
  /// Of the same name, or else the nearest that looks the same way. One that was leaving comes back as one that has no
  /// other past: left to itself, both would be felt.
  const auto successor_of = [&](const FeltContact& old) {
    std::size_t successor = kNoContact;
    double nearest_m = kSamePlace_m;
    for (std::size_t j = 0; j < arriving.size(); ++j) {
      const contact::Contact &now = arriving[j].received.contact, &was = old.received.contact;
      const FeltContact::Sample& at = arriving[j].here;
      if (match.is_old[j] || (old.transition.is_leaving && has_past[j]) || now.object != was.object ||
          at.depth_m < -kSuccessorsGap_m || !resists_like(old, arriving[j]) ||
          glm::dot(now.nhat_ST_W, old.transition.nhat_W) < kSameDirection)
        continue;
      const double distance_m = now.id == was.id ? -1 : glm::length(at.p_ToC_W - old.here.p_ToC_W);
      if (distance_m < nearest_m) nearest_m = distance_m, successor = j;
    }
    return successor;
  };
  for (const bool is_leaving : {false, true}) {
    for (std::size_t i = 0; i < felt.size(); ++i) {
      if (!match.stays[i] && felt[i].transition.is_leaving == is_leaving) match.successor[i] = successor_of(felt[i]);
    }
    for (std::size_t i = 0; i < felt.size() && !is_leaving; ++i)
      if (match.successor[i] != kNoContact && felt[i].felt_m() > 0) has_past[match.successor[i]] = true;
  }
  return match;
}

}  // namespace farfeel::local_model
