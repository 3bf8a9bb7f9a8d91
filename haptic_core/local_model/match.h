// Which felt contact goes on as which contact that arrives. A function of both and nothing else.
//
// Names come first and places second, because the contacts found here and those of the remote have different names,
// where flat faces meet names change from tick to tick, and an answer that was lost hides who came between. A felt one
//   goes on             as the same contact, looked at from where the tool is now
//   has a successor     which starts with its force and those of others that it replaces
//   or neither          and leaves
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/local_model/felt_contact.h"

namespace farfeel::local_model {

inline constexpr std::size_t kMaxFelt = 2 * contact::kMaxContacts;  ///< those received, and as many that leave
inline constexpr std::size_t kNoContact = ~std::size_t{0};

struct Match {
  struct Pair {
    std::size_t felt, arriving;
  };
  std::array<Pair, contact::kMaxContacts> goes_on;  ///< in the order in which they were found
  std::size_t goes_on_count = 0;
  std::array<bool, kMaxFelt> stays{};                ///< of each felt one: it goes on, or is untouched
  std::array<bool, contact::kMaxContacts> is_old{};  ///< the same of each arriving one
  std::array<std::size_t, kMaxFelt> successor;       ///< of each felt one that does not stay: who takes its place
};

/// Felt and arriving ones are sampled at one tool pose (FeltContact::here), the arriving ones as received. stays_as: of
/// each arriving one, the felt one that it is, untouched; kNoContact: it is new. What the remote has told anew is
/// linearised elsewhere, and nothing goes on as that. At most kMaxFelt and kMaxContacts.
[[nodiscard]] Match match(std::span<const FeltContact> felt, std::span<const FeltContact> arriving,
                          std::span<const std::size_t> stays_as) noexcept;

}  // namespace farfeel::local_model
