// How often contacts that push are in doubt, and of what: shares for a report. What is apart is in doubt only where the
// coarse pieces' own distance does not confirm its gap.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/penetration/penetration.h"

namespace farfeel::contact {

struct NamedDoubt {
  std::uint8_t bit;
  std::string_view name;  ///< as files have it
  std::string_view told;  ///< as a person reads it
};
inline constexpr std::array<NamedDoubt, 6> kNamedDoubts{{
    {penetration::kBorder, "border", "at the window's border"},
    {penetration::kSilhouette, "silhouette", "at an edge"},
    {penetration::kGrazing, "grazing", "grazing"},
    {penetration::kSeveralLayers, "several_layers", "in several layers"},
    {penetration::kCoarseSteps, "coarse_steps", "unresolved"},
    {kFeltAsCoarse, "felt_as_coarse", "felt as coarse"},
}};

/// A plain value: it crosses threads. Realtime-safe.
struct DoubtCounts {
  std::uint64_t contacts = 0;  ///< that push
  std::array<std::uint64_t, kNamedDoubts.size()> in_doubt{};

  void add(const ContactSet& set) noexcept {
    for (std::uint32_t i = 0; i < set.count; ++i) {
      if (!(set.contacts[i].depth_m > 0)) continue;
      ++contacts;
      for (std::size_t d = 0; d < in_doubt.size(); ++d)
        in_doubt[d] += (set.contacts[i].doubts & kNamedDoubts[d].bit) != 0;
    }
  }
  /// Of the contacts, in [0, 1]; none without contacts.
  [[nodiscard]] double share(std::size_t doubt) const noexcept {
    return contacts > 0 ? static_cast<double>(in_doubt[doubt]) / static_cast<double>(contacts) : 0;
  }
};

}  // namespace farfeel::contact
