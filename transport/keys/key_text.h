// Keys, fingerprints, names and dates as people write, paste and read them aloud.
//
// A key is one word: pub_, secret_ or psk_, then 48 letters of the URL-safe base64 alphabet: the 32 bytes and 4 more
// that are a hash of kind and key. A slip of the hand, half a line, or a secret where a public key belongs is told at
// once instead of being an unknown key later. Pure functions; any text is safe.
#pragma once

#include <string>
#include <string_view>

#include "transport/keys/error.h"
#include "transport/seal/suite.h"

namespace farfeel::transport {

enum class KeyKind : std::uint8_t { kPublic, kSecret, kPsk };

[[nodiscard]] std::string key_to_text(KeyKind, const Key32&);
[[nodiscard]] KeysResult<Key32> key_from_text(KeyKind, std::string_view);

/// Six groups of five digits, made of a hash of the public key: 99 bits. Nobody can make a key with a fingerprint that
/// he was told, and two people can compare it over a telephone.
[[nodiscard]] std::string fingerprint(const Key32& public_key);

/// 1 to 32 letters, digits, dots, hyphens and underscores, a letter or digit first.
[[nodiscard]] bool is_name(std::string_view);
/// What is_name allows of the text, for suggesting a name; "this-machine" where nothing is left.
[[nodiscard]] std::string as_name(std::string_view);

/// The first moment after the day that is named, in UTC [ns since 1970]. "2027-01-31"; years 1970 to 2261.
[[nodiscard]] KeysResult<std::int64_t> end_of_day_ns(std::string_view date);
/// The day that ends at that moment.
[[nodiscard]] std::string date_ending_at(std::int64_t end_ns);

}  // namespace farfeel::transport
