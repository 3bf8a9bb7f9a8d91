// Any text as an identity file, a key, a date and a list of trusted keys; and lists changed by the commands.

#include <algorithm>
#include <cstdlib>
#include <string>

#include "transport/keys/key_folder.h"
#include "transport/keys/key_text.h"
#include "transport/keys/trust_file.h"

using namespace farfeel::transport;

namespace {

void demand(bool is_so) {
  if (!is_so) std::abort();
}

bool is_same(const TrustEntry& a, const TrustEntry& b) {
  return a.name == b.name && a.public_key == b.public_key && a.expires_ns == b.expires_ns && a.psk == b.psk &&
         a.roles == b.roles;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const Key32 fresh_key = new_key_pair().public_key;
  const std::string text(reinterpret_cast<const char*>(bytes), size);

  if (const auto pair = identity_from_text(text); !pair) demand(!pair.error().message.empty());
  for (const KeyKind kind : {KeyKind::kPublic, KeyKind::kSecret, KeyKind::kPsk}) {
    const auto key = key_from_text(kind, text);
    if (key) demand(key_to_text(kind, *key) == text);  // one key, one word
  }
  if (const auto end_ns = end_of_day_ns(text)) demand(date_ending_at(*end_ns) == text);
  demand(is_name(as_name(text)));

  const TrustEntries read = read_trust_text(text);
  for (const TrustEntry& entry : read.entries) {
    demand(is_name(entry.name));
    const TrustEntries again = read_trust_text(trust_line(entry));
    demand(again.trouble.empty() && again.entries.size() == 1 && is_same(again.entries[0], entry));
    const auto without = without_entry(text, entry.name);
    demand(without.has_value() && !without_entry(*without, entry.name));
    const auto left = read_trust_text(*without);
    demand(std::ranges::none_of(left.entries, [&](const TrustEntry& e) { return e.name == entry.name; }));
  }

  TrustEntry fresh;
  fresh.name = "fresh";
  fresh.public_key = fresh_key;
  const auto with = with_entry(text, fresh);
  demand(read.trouble.empty() || !with);
  if (with) {
    // Everybody who was in it still is, as before, and the new one besides.
    const TrustEntries now = read_trust_text(*with);
    demand(now.trouble.empty() && now.entries.size() == read.entries.size() + 1);
    for (std::size_t i = 0; i < read.entries.size(); ++i) demand(is_same(now.entries[i], read.entries[i]));
    demand(is_same(now.entries.back(), fresh));
  }
  return 0;
}
