// Whom this machine trusts, as a running program asks: the file of trust_file.h, read again when it changed.
//
// Who no longer stands in the file, or whose day is over, is out at the next look. When in doubt nobody comes in:
//   - a file that is gone means that nobody is trusted;
//   - a file with a line that cannot be read, or that is not private any more, adds nobody; of those who were trusted,
//     those stay who stand in it still (where it can be read at all);
//   - trouble() says so until the file is right again.
//
// One thread at a time. refresh and find may take a file's read: never in a haptic tick. A slave that is confined keeps
// the right to read the folder.
#pragma once

#include <ctime>
#include <string>
#include <vector>

#include "transport/keys/error.h"
#include "transport/keys/trust_file.h"

namespace farfeel::transport {

class TrustList {
 public:
  /// Fails where the file is there and not right: a program starts with a list that is right. A file that is not there
  /// is an empty list.
  [[nodiscard]] static KeysResult<TrustList> open(std::string path);

  enum class Standing : std::uint8_t { kTrusted, kExpired, kUnknown };
  struct Found {
    Standing standing = Standing::kUnknown;
    const TrustEntry* entry = nullptr;  ///< of the list, until it is refreshed; null for kUnknown
  };
  [[nodiscard]] Found find(const Key32& public_key, std::int64_t wall_clock_ns) const noexcept;
  [[nodiscard]] const TrustEntry* find_name(std::string_view name) const noexcept;
  [[nodiscard]] const std::vector<TrustEntry>& entries() const noexcept { return entries_; }

  /// Looks whether the file changed: one system call where it did not. Cheap enough for every 250 ms. True if entries
  /// or trouble may be others now; then ask find again about whoever is connected. Expiry needs no change: ask find for
  /// that at every look.
  bool refresh();
  /// What is wrong with the file at present, and what to do; empty where all is well.
  [[nodiscard]] const std::string& trouble() const noexcept { return trouble_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  explicit TrustList(std::string path) : path_(std::move(path)) {}
  struct Look {  // at the file, from outside: as long as it stays the same, the file is not read
    bool is_there = false;
    std::uint64_t inode = 0, device = 0;
    std::int64_t size = 0, modified_ns = 0, changed_ns = 0;
    bool operator==(const Look&) const = default;
  };
  [[nodiscard]] Look look() const noexcept;
  KeysResult<TrustEntries> read() const;

  std::string path_, trouble_;
  std::vector<TrustEntry> entries_;
  Look seen_;
  bool is_sure_ = false;  // that seen_ would differ if the file were changed once more
};

}  // namespace farfeel::transport
