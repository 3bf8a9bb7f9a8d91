// The folder that holds who this machine is and whom it trusts.
//
//   identity    its secret key             operators   who may operate this machine (a slave's list)
//   counter     handshake_counter.h        slaves      whom this machine may operate (a master's list)
//
// The folder is mode 0700 and the files 0600, of the user who runs the program; anything else is refused with the
// command that mends it. Changes go through a lock and put whole files in place: two programs at once lose nothing.
#pragma once

#include <string>

#include "transport/keys/error.h"
#include "transport/keys/handshake_counter.h"
#include "transport/keys/trust_list.h"
#include "transport/seal/suite.h"

namespace farfeel::transport {

enum class Role : std::uint8_t { kOperator, kSlave };
[[nodiscard]] std::string_view name_of(Role) noexcept;  ///< "operator", "slave"

/// $XDG_CONFIG_HOME/farfeel/keys, or ~/.config/farfeel/keys.
[[nodiscard]] KeysResult<std::string> default_key_folder();

class KeyFolder {
 public:
  /// A folder that is there. kMissing where there is none: then `farfeel key new` makes one.
  [[nodiscard]] static KeysResult<KeyFolder> open(const std::string& path);
  /// Makes the folder where it is not there.
  [[nodiscard]] static KeysResult<KeyFolder> make(const std::string& path);
  /// For sessions on this machine alone, without keys that anybody made: a folder of the user's own, under
  /// $XDG_RUNTIME_DIR, or /tmp/farfeel-UID where that is not the user's. Whichever program comes first fills it; its
  /// identity stands in both lists.
  [[nodiscard]] static KeysResult<KeyFolder> open_loopback();
  /// The one that a program uses: `path` if it is not empty, else the loopback folder where both ends are on this
  /// machine, else the user's own.
  [[nodiscard]] static KeysResult<KeyFolder> open_for(const std::string& path, bool is_this_machine);

  /// kMissing where there is no identity yet.
  [[nodiscard]] KeysResult<KeyPair> identity() const;
  /// kConflict where there is one already: who it was would be lost.
  [[nodiscard]] KeysResult<KeyPair> make_identity() const;

  [[nodiscard]] KeysResult<TrustList> trusted(Role) const;
  /// Adds the entry, or renews the one that has its name and key.
  [[nodiscard]] KeysResult<void> trust(Role, const TrustEntry&) const;
  /// True if somebody of that name was there.
  [[nodiscard]] KeysResult<bool> revoke(Role, std::string_view name) const;

  [[nodiscard]] KeysResult<HandshakeCounter> counter() const;

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] std::string path_of(Role) const;

 private:
  explicit KeyFolder(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

/// The secret key in the text of an identity file. Any text is safe.
[[nodiscard]] KeysResult<KeyPair> identity_from_text(std::string_view text);

}  // namespace farfeel::transport
