// Small files that only their owner may read, in a folder that only its owner may enter; changed as a whole or not at
// all. Every failure says which command mends it.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

#include "transport/keys/error.h"

namespace farfeel::transport {

/// Files beyond this are no lists of keys.
inline constexpr std::size_t kKeyFileBytesMax = std::size_t{1} << 20;

/// That the folder is there, ours (of the effective user), and mode 0700 or less. kMissing where there is none.
[[nodiscard]] KeysResult<void> check_private_folder(const std::string& folder);
/// Makes the folder and what lacks above it, if it is not there; then checks it.
[[nodiscard]] KeysResult<void> make_private_folder(const std::string& folder);
/// Makes, if they are not there, and checks $XDG_RUNTIME_DIR/farfeel/NAME, or /tmp/farfeel-UID/farfeel/NAME where that
/// is not set or not ours: what lives no longer than this machine is up. Gives its path.
[[nodiscard]] KeysResult<std::string> make_runtime_folder(std::string_view name);
/// The whole of a file that is ours and that nobody else may read or write. kMissing where there is none.
[[nodiscard]] KeysResult<std::string> read_private_file(const std::string& path);
/// Puts text in place of the file, mode 0600: whoever reads sees all of the old or all of the new, and so does the disk
/// after a power cut. Hold the folder's lock.
[[nodiscard]] KeysResult<void> write_private_file(const std::string& path, std::string_view text);

/// One program at a time changes a folder. Whoever only reads needs no lock. Held until it ends; waits 5 s at most.
class FolderLock {
 public:
  [[nodiscard]] static KeysResult<FolderLock> take(const std::string& folder);
  FolderLock(FolderLock&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  FolderLock& operator=(FolderLock&&) = delete;
  ~FolderLock();

 private:
  explicit FolderLock(int fd) noexcept : fd_(fd) {}
  int fd_;
};

}  // namespace farfeel::transport
