#include "transport/keys/key_folder.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "transport/keys/checked_file.h"
#include "transport/keys/key_text.h"

namespace farfeel::transport {
namespace {

constexpr std::string_view kIdentityHead =
    "# The secret key of this machine. Whoever has it is this machine to others: never copy it, never show it.\n";
constexpr std::string_view kOperatorsHead =
    "# Who may operate this machine. A line: name, public key, and if wished expires=2027-01-31 and psk=psk_...\n";
constexpr std::string_view kSlavesHead =
    "# Whom this machine may operate. A line: name, public key, and if wished expires=2027-01-31 and psk=psk_...\n";
constexpr std::string_view kLoopbackName = "this-machine";

void wipe_text(std::string& text) {
  wipe(std::as_writable_bytes(std::span(text)));
}

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// The file's text, and what it begins with where there is none. Under the lock.
KeysResult<std::string> text_or_head(const std::string& path, Role role) {
  auto text = read_private_file(path);
  if (!text && text.error().kind == KeysErrorKind::kMissing)
    return std::string(role == Role::kOperator ? kOperatorsHead : kSlavesHead);
  return text;
}

KeysError named(KeysError error, const std::string& path) {
  error.message = fmt::format("{}: {}", path, error.message);
  return error;
}

}  // namespace

std::string_view name_of(Role role) noexcept {
  return role == Role::kOperator ? "operator" : "slave";
}

KeysResult<std::string> default_key_folder() {
  std::string above = environment("XDG_CONFIG_HOME");
  if (above.empty() && !environment("HOME").empty()) above = environment("HOME") + "/.config";
  if (above.empty())
    return tl::unexpected(
        KeysError{KeysErrorKind::kMissing, "neither XDG_CONFIG_HOME nor HOME is set: name the folder of the keys"});
  return above + "/farfeel/keys";
}

KeysResult<KeyFolder> KeyFolder::open(const std::string& path) {
  if (const auto ok = check_private_folder(path); !ok) return tl::unexpected(ok.error());
  return KeyFolder(path);
}

KeysResult<KeyFolder> KeyFolder::make(const std::string& path) {
  if (const auto ok = make_private_folder(path); !ok) return tl::unexpected(ok.error());
  return KeyFolder(path);
}

KeysResult<KeyFolder> KeyFolder::open_for(const std::string& path, bool is_this_machine) {
  if (path.empty() && is_this_machine) return open_loopback();
  const auto wanted = path.empty() ? default_key_folder() : path;
  if (!wanted) return tl::unexpected(wanted.error());
  auto folder = open(*wanted);
  if (!folder && folder.error().kind == KeysErrorKind::kMissing)
    folder.error().message =
        "there are no keys in " + *wanted +
        ": make this machine's with  farfeel key new  and trust the other end's; docs/two-machines.md "
        "has the steps";
  return folder;
}

KeysResult<KeyFolder> KeyFolder::open_loopback() {
  const auto made = make_runtime_folder("loopback");
  if (!made) return tl::unexpected(made.error());
  const std::string& path = *made;
  const KeyFolder folder(path);
  auto found = folder.identity();
  if (found) return folder;
  if (found.error().kind != KeysErrorKind::kMissing) return tl::unexpected(found.error());

  // The identity comes last, so that whoever sees it sees the lists too.
  const auto lock = FolderLock::take(path);
  if (!lock) return tl::unexpected(lock.error());
  if (found = folder.identity(); found) return folder;
  const KeyPair pair = new_key_pair();
  TrustEntry itself;
  itself.name = kLoopbackName;
  itself.public_key = pair.public_key;
  for (const Role role : {Role::kOperator, Role::kSlave}) {
    const auto written = write_private_file(folder.path_of(role), trust_line(itself) + "\n");
    if (!written) return tl::unexpected(written.error());
  }
  std::string text = fmt::format("{}{}\n", kIdentityHead, key_to_text(KeyKind::kSecret, pair.secret));
  const auto written = write_private_file(path + "/identity", text);
  wipe_text(text);
  if (!written) return tl::unexpected(written.error());
  return folder;
}

KeysResult<KeyPair> identity_from_text(std::string_view text) {
  std::optional<KeyPair> pair;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    while (!line.empty() && std::strchr(" \t\r", line.back()) != nullptr) line.remove_suffix(1);
    if (line.empty() || line.front() == '#') continue;
    if (pair) return tl::unexpected(KeysError{KeysErrorKind::kMalformed, "there are two keys in it"});
    const auto secret = key_from_text(KeyKind::kSecret, line);
    if (!secret) return tl::unexpected(secret.error());
    pair = key_pair_of(*secret);
  }
  if (!pair) return tl::unexpected(KeysError{KeysErrorKind::kMalformed, "there is no key in it"});
  return *pair;
}

KeysResult<KeyPair> KeyFolder::identity() const {
  const std::string path = path_ + "/identity";
  auto text = read_private_file(path);
  if (!text && text.error().kind == KeysErrorKind::kMissing)
    return tl::unexpected(KeysError{
        KeysErrorKind::kMissing, fmt::format("this machine has no key in {}: make one with  farfeel key new", path_)});
  if (!text) return tl::unexpected(text.error());
  auto pair = identity_from_text(*text);
  wipe_text(*text);
  if (!pair) return tl::unexpected(named(pair.error(), path));
  return pair;
}

KeysResult<KeyPair> KeyFolder::make_identity() const {
  const auto lock = FolderLock::take(path_);
  if (!lock) return tl::unexpected(lock.error());
  const std::string path = path_ + "/identity";
  std::error_code trouble;
  if (std::filesystem::exists(std::filesystem::symlink_status(path, trouble)))
    return tl::unexpected(KeysError{
        KeysErrorKind::kConflict,
        fmt::format("there is a key in {0} already, and those who trust this machine know it by that. See it with  "
                    "farfeel key show.  To begin anew, put it aside:  mv '{0}' '{0}.old'",
                    path)});
  const KeyPair pair = new_key_pair();
  std::string text = fmt::format("{}{}\n", kIdentityHead, key_to_text(KeyKind::kSecret, pair.secret));
  const auto written = write_private_file(path, text);
  wipe_text(text);
  if (!written) return tl::unexpected(written.error());
  return pair;
}

std::string KeyFolder::path_of(Role role) const {
  return path_ + (role == Role::kOperator ? "/operators" : "/slaves");
}

KeysResult<TrustList> KeyFolder::trusted(Role role) const {
  return TrustList::open(path_of(role));
}

KeysResult<void> KeyFolder::trust(Role role, const TrustEntry& entry) const {
  const auto lock = FolderLock::take(path_);
  if (!lock) return tl::unexpected(lock.error());
  auto text = text_or_head(path_of(role), role);
  if (!text) return tl::unexpected(text.error());
  auto changed = with_entry(*text, entry);
  wipe_text(*text);
  if (!changed) return tl::unexpected(named(changed.error(), path_of(role)));
  const auto written = write_private_file(path_of(role), *changed);
  wipe_text(*changed);
  return written;
}

KeysResult<bool> KeyFolder::revoke(Role role, std::string_view name) const {
  const auto lock = FolderLock::take(path_);
  if (!lock) return tl::unexpected(lock.error());
  auto text = text_or_head(path_of(role), role);
  if (!text) return tl::unexpected(text.error());
  auto changed = without_entry(*text, name);
  wipe_text(*text);
  if (!changed) return false;
  const auto written = write_private_file(path_of(role), *changed);
  wipe_text(*changed);
  if (!written) return tl::unexpected(written.error());
  return true;
}

KeysResult<HandshakeCounter> KeyFolder::counter() const {
  return HandshakeCounter::open(path_ + "/counter");
}

}  // namespace farfeel::transport
