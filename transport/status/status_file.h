// Where programs tell what is known of their links, and where `farfeel link-status` reads it: one small file a program,
// in a folder that only its user may enter: $XDG_RUNTIME_DIR/farfeel/links, else
// /tmp/farfeel-UID/farfeel/links.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "transport/error.h"
#include "transport/status/link_status.h"

namespace farfeel::transport {

[[nodiscard]] std::string to_json(const LinkStatus&);
/// Nothing but an error where a field is missing or of another kind.
[[nodiscard]] tl::expected<LinkStatus, Error> link_status_from_json(std::string_view text);

/// The folder, made if it is not there, and ours.
[[nodiscard]] tl::expected<std::string, Error> link_status_folder();

/// This program's file, opened once: afterwards the program may be confined. It is swept up when the program is gone,
/// by the next one that opens or reads. One thread.
class StatusFile {
 public:
  [[nodiscard]] static tl::expected<StatusFile, Error> open(const std::string& folder);
  StatusFile(StatusFile&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  StatusFile& operator=(StatusFile&&) = delete;
  ~StatusFile();

  /// A figure that cannot be told is no reason to stop: what fails is left out until the next time.
  void write(const LinkStatus&) const noexcept;

 private:
  explicit StatusFile(int fd) : fd_(fd) {}
  int fd_;
};

/// In link_status_folder().
[[nodiscard]] tl::expected<StatusFile, Error> open_status_file();

/// Of all programs of this user that are alive, by process number. Files of dead ones are removed.
[[nodiscard]] std::vector<LinkStatus> read_link_statuses(const std::string& folder);

}  // namespace farfeel::transport
