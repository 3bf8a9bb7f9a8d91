#include "transport/keys/trust_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "transport/keys/key_text.h"

namespace farfeel::transport {
namespace {

constexpr std::size_t kLineMax = 1024;     // an entry with all it can have takes some 150 letters
constexpr std::size_t kEntriesMax = 4096;  // at most 256 letters each in the longest file that is read
constexpr std::string_view kExpires = "expires=";
constexpr std::string_view kPsk = "psk=";
constexpr std::string_view kRole = "role=";

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

// The next line without its end; text loses it.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

// The next word, or nothing at the end of what is said; line loses it. At a comment line is left with the comment.
std::string_view take_word(std::string_view& line) {
  while (!line.empty() && is_space(line.front())) line.remove_prefix(1);
  if (line.empty() || line.front() == '#') return {};
  const auto end = static_cast<std::size_t>(std::ranges::find_if(line, is_space) - line.begin());
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(end);
  return word;
}

std::string_view first_word(std::string_view line) {
  return take_word(line);
}

// What stands behind the entry.
std::string_view comment_of(std::string_view line) {
  while (!take_word(line).empty()) {
  }
  return line;
}

KeysResult<TrustEntry> entry_of(std::string_view line) {
  const auto malformed = [](std::string message) {
    return tl::unexpected(KeysError{KeysErrorKind::kMalformed, std::move(message)});
  };
  if (line.size() > kLineMax) return malformed(fmt::format("it is longer than {} letters", kLineMax));
  TrustEntry entry;
  entry.name = take_word(line);
  if (!is_name(entry.name)) return malformed("it does not begin with a name of letters, digits and . - _");
  const std::string_view key = take_word(line);
  if (key.empty()) return malformed(fmt::format("{} has no public key behind it", entry.name));
  const auto public_key = key_from_text(KeyKind::kPublic, key);
  if (!public_key) return tl::unexpected(public_key.error());
  entry.public_key = *public_key;
  bool has_roles = false;
  for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
    if (word.starts_with(kExpires) && !entry.expires_ns) {
      const auto end_ns = end_of_day_ns(word.substr(kExpires.size()));
      if (!end_ns) return tl::unexpected(end_ns.error());
      entry.expires_ns = *end_ns;
    } else if (word.starts_with(kPsk) && !entry.psk) {
      const auto psk = key_from_text(KeyKind::kPsk, word.substr(kPsk.size()));
      if (!psk) return tl::unexpected(psk.error());
      entry.psk = *psk;
    } else if (word.starts_with(kRole) && !has_roles) {
      const auto roles = roles_from_text(word.substr(kRole.size()));
      if (!roles) return malformed("role= is a list of operate, watch and edit, as in role=operate,edit");
      entry.roles = *roles;
      has_roles = true;
    } else {
      return malformed("behind the key it has something other than one expires=, one psk= and one role=");
    }
  }
  return entry;
}

}  // namespace

std::optional<Roles> roles_from_text(std::string_view text) {
  Roles roles{false, false, false};
  while (true) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::string_view word = text.substr(0, comma);
    bool* const role = word == "operate" ? &roles.operates
                       : word == "watch" ? &roles.watches
                       : word == "edit"  ? &roles.edits
                                         : nullptr;
    if (role == nullptr || *role) return std::nullopt;
    *role = true;
    if (comma == text.size()) return roles;
    text.remove_prefix(comma + 1);
  }
}

std::string roles_to_text(const Roles& roles) {
  std::string text;
  for (const auto& [has, word] :
       {std::pair{roles.operates, "operate"}, {roles.watches, "watch"}, {roles.edits, "edit"}}) {
    if (has) text += (text.empty() ? "" : ",") + std::string(word);
  }
  return text;
}

TrustEntries read_trust_text(std::string_view text) {
  TrustEntries read;
  const auto note = [&](std::size_t line_number, std::string_view what) {
    if (read.trouble.empty()) read.trouble = fmt::format("line {}: {}", line_number, what);
  };
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = take_line(text);
    if (first_word(line).empty()) continue;
    auto entry = entry_of(line);
    if (!entry) {
      note(number, entry.error().message);
      continue;
    }
    const bool is_again = std::ranges::any_of(
        read.entries, [&](const TrustEntry& e) { return e.name == entry->name || e.public_key == entry->public_key; });
    if (is_again)
      note(number, fmt::format("the name {} or its key stands in a line above", entry->name));
    else if (read.entries.size() == kEntriesMax)
      note(number, fmt::format("there are more than {} entries", kEntriesMax));
    else
      read.entries.push_back(std::move(*entry));
  }
  return read;
}

std::string trust_line(const TrustEntry& entry) {
  std::string line = fmt::format("{}  {}", entry.name, key_to_text(KeyKind::kPublic, entry.public_key));
  if (entry.expires_ns) line += fmt::format("  {}{}", kExpires, date_ending_at(*entry.expires_ns));
  if (entry.psk) line += fmt::format("  {}{}", kPsk, key_to_text(KeyKind::kPsk, *entry.psk));
  if (entry.roles != Roles{}) line += fmt::format("  {}{}", kRole, roles_to_text(entry.roles));
  return line;
}

KeysResult<std::string> with_entry(std::string_view text, const TrustEntry& entry) {
  const auto conflict = [](std::string message) {
    return tl::unexpected(KeysError{KeysErrorKind::kConflict, std::move(message)});
  };
  const TrustEntries read = read_trust_text(text);
  if (!read.trouble.empty()) return tl::unexpected(KeysError{KeysErrorKind::kMalformed, read.trouble});
  for (const TrustEntry& other : read.entries) {
    if (other.name == entry.name && other.public_key != entry.public_key)
      return conflict(
          fmt::format("{0} is trusted with another key (fingerprint {1}). If that one is no longer right, run  "
                      "farfeel key revoke {0}  first; else choose another name",
                      entry.name, fingerprint(other.public_key)));
    if (other.name != entry.name && other.public_key == entry.public_key)
      return conflict(fmt::format(
          "this key is trusted already, as {0}. To rename it, run  farfeel key revoke {0}  first", other.name));
  }
  if (read.entries.size() == kEntriesMax)
    return conflict(fmt::format("the list has {} entries: it is full", kEntriesMax));
  std::string changed;
  bool is_placed = false;
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (first_word(line) == entry.name) {
      const std::string_view comment = comment_of(line);
      changed += fmt::format("{}{}{}\n", trust_line(entry), comment.empty() ? "" : "  ", comment);
      is_placed = true;
    } else {
      changed += fmt::format("{}\n", line);
    }
  }
  if (!is_placed) changed += trust_line(entry) + "\n";
  return changed;
}

std::optional<std::string> without_entry(std::string_view text, std::string_view name) {
  std::string changed;
  bool is_there = false;
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (first_word(line) == name && !name.empty())
      is_there = true;
    else
      changed += fmt::format("{}\n", line);
  }
  if (!is_there) return std::nullopt;
  return changed;
}

}  // namespace farfeel::transport
