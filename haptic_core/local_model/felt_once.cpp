#include "haptic_core/local_model/felt_once.h"

#include <algorithm>
#include <limits>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/local_model/constants.h"

namespace farfeel::local_model {
namespace {

constexpr std::size_t kNone = ~std::size_t{0};

bool is_near(const PlacedContact& a, const PlacedContact& b) {
  return looks_like(a, b) && glm::distance(a.p_T, b.p_T) < kSamePlace_m;
}

}  // namespace

PlacedContact placed(const contact::Contact& here, const spatial::Pose& X_WT, double off_m) noexcept {
  return {here.object, here.nhat_ST_W, glm::conjugate(X_WT.R) * (here.p_WC_W - X_WT.p), here.depth_m, off_m};
}

bool looks_like(const PlacedContact& a, const PlacedContact& b) noexcept {
  return a.object == b.object && glm::dot(a.nhat_W, b.nhat_W) >= kSameDirection;
}

double depth_within_m(const PlacedContact& found, double told_depth_m) noexcept {
  const double off_m = found.off_m + kFoundSlack_m;
  return std::clamp(told_depth_m, found.depth_m - off_m, found.depth_m + off_m);
}

FeltOnce felt_once(std::span<const PlacedContact> found, std::span<const PlacedContact> told) noexcept {
  FeltOnce felt;
  if (ablated(Mechanism::kFeltOnce)) {
    felt.told.fill(true);
    return felt;
  }
  std::array<std::size_t, contact::kMaxContacts> nearest{};  // found one of each told one
  std::array<bool, contact::kMaxContacts> is_credible{};     // no deeper than all that is near allows
  for (std::size_t t = 0; t < told.size(); ++t) {
    nearest[t] = kNone;
    double nearest_m = kSamePlace_m, most_m = -std::numeric_limits<double>::infinity();
    for (std::size_t f = 0; f < found.size(); ++f) {
      if (!is_near(found[f], told[t])) continue;
      most_m = std::max(most_m, found[f].depth_m + found[f].off_m + kFoundSlack_m);
      const double apart_m = glm::distance(found[f].p_T, told[t].p_T);
      if (apart_m < nearest_m) nearest_m = apart_m, nearest[t] = f;
    }
    is_credible[t] = nearest[t] == kNone || told[t].depth_m <= most_m;
  }
  for (std::size_t f = 0; f < found.size(); ++f) {
    bool is_spoken_of = false, is_told = false;
    double deepest_m = -std::numeric_limits<double>::infinity();
    for (std::size_t t = 0; t < told.size(); ++t) {
      if (!looks_like(found[f], told[t]) || !(nearest[t] == kNone || is_near(found[f], told[t]))) continue;
      is_spoken_of = true;
      deepest_m = std::max(deepest_m, told[t].depth_m);
      is_told = is_told || (is_credible[t] && depth_within_m(found[f], told[t].depth_m) <= told[t].depth_m);
    }
    felt.found[f] = !is_told;
    felt.found_depth_m[f] = is_spoken_of ? depth_within_m(found[f], deepest_m) : found[f].depth_m;
  }
  for (std::size_t t = 0; t < told.size(); ++t)
    felt.told[t] = is_credible[t] && (nearest[t] == kNone || !felt.found[nearest[t]]);
  return felt;
}

}  // namespace farfeel::local_model
