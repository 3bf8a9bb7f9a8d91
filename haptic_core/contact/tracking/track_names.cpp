#include "haptic_core/contact/tracking/track_names.h"

namespace farfeel::contact {
namespace {

constexpr std::uint32_t kMostTaken = 0xFFFF'FFFF / TrackNames::kSlots;

}  // namespace

std::uint32_t TrackNames::name(std::uint32_t object, std::uint32_t cluster) noexcept {
  std::uint32_t taken = 0;
  bool is_known = false;
  for (std::uint32_t i = 0; i < kSlots && !is_known; ++i) {
    const Slot& slot = slots_[i];
    is_known = slot.named + 1 >= update_ && slot.named != 0 && slot.object == object && slot.cluster == cluster;
    if (is_known || slot.named < slots_[taken].named) taken = i;
  }
  Slot& slot = slots_[taken];
  if (!is_known) {
    slot.object = object;
    slot.cluster = cluster;
    slot.times_taken = slot.times_taken < kMostTaken ? slot.times_taken + 1 : 1;  // 0 is nobody's name
  }
  slot.named = update_;
  return slot.times_taken * kSlots + taken;
}

}  // namespace farfeel::contact
