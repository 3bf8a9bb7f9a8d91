// A list of those whom this machine trusts, as text: one a line, comments kept.
//
//   # who may operate this machine
//   anna  pub_...  expires=2027-01-31  psk=psk_...   # until the end of that day, UTC
//   bert  pub_...  role=operate,edit
//
// A line is a name, a public key and what is wished of expires=, psk= and role=; all after a word that begins with # is
// comment. Pure functions of text; any text is safe.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "transport/keys/error.h"
#include "transport/seal/suite.h"

namespace farfeel::transport {

/// What an operator may do: feel with a hand, watch the scene, edit it. Who may edit may watch.
struct Roles {
  bool operates = true, watches = false, edits = false;
  friend bool operator==(const Roles&, const Roles&) = default;
};
/// From "operate,edit" and the like: each of operate, watch, edit at most once.
[[nodiscard]] std::optional<Roles> roles_from_text(std::string_view);
[[nodiscard]] std::string roles_to_text(const Roles&);

struct TrustEntry {
  std::string name;
  Key32 public_key{};
  std::optional<std::int64_t> expires_ns{};  ///< the first moment at which it is trusted no more [since 1970]
  std::optional<Key32> psk{};
  Roles roles{};  ///< among operators

  ~TrustEntry() {
    if (psk) wipe(*psk);
  }
  /// For the handshake: the psk, or 32 zero bytes.
  [[nodiscard]] Key32 psk_or_zeros() const noexcept { return psk.value_or(Key32{}); }
  [[nodiscard]] bool is_expired(std::int64_t wall_clock_ns) const noexcept {
    return expires_ns && wall_clock_ns >= *expires_ns;
  }
};

/// Lines that cannot be read, or that name a name or key again, are left out, and the first of them is the trouble.
struct TrustEntries {
  std::vector<TrustEntry> entries;
  std::string trouble;  ///< "line 3: ..."; empty where all is well
};

[[nodiscard]] TrustEntries read_trust_text(std::string_view text);

/// The entry as a line, without an end of line.
[[nodiscard]] std::string trust_line(const TrustEntry&);
/// The text with the entry at its end, or in place of the line that has its name. kMalformed where the text has a
/// trouble; kConflict where another line has the key, or the name with another key.
[[nodiscard]] KeysResult<std::string> with_entry(std::string_view text, const TrustEntry&);
/// The text without the lines that begin with the name, whatever else stands in them; nothing if there is none.
[[nodiscard]] std::optional<std::string> without_entry(std::string_view text, std::string_view name);

}  // namespace farfeel::transport
