// Where programs tell what is known of their links, and where `farfeel link-status` reads it: one small file a program,
// replaced as a whole, in a folder that only its user may enter: $XDG_RUNTIME_DIR/farfeel/links, else
// /tmp/farfeel-UID/farfeel/links.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "transport/error.h"
#include "transport/status/link_status.h"

namespace farfeel::transport {

[[nodiscard]] std::string to_json(const LinkStatus&);
/// Nothing but an error where a field is missing or of another kind.
[[nodiscard]] tl::expected<LinkStatus, Error> link_status_from_json(std::string_view text);

/// The folder, made if it is not there, and ours.
[[nodiscard]] tl::expected<std::string, Error> link_status_folder();

/// This program's file. One thread; it goes with the program, or is swept up by who reads after a kill.
class StatusFile {
 public:
  explicit StatusFile(std::string folder);
  StatusFile(StatusFile&& other) noexcept : path_(std::move(other.path_)) { other.path_.clear(); }
  StatusFile& operator=(StatusFile&&) = delete;
  ~StatusFile();

  /// A figure that cannot be told is no reason to stop: what fails is left out until the next time.
  void write(const LinkStatus&) const noexcept;

 private:
  std::string path_;
};

/// Of all programs of this user that are alive, by process number. Files of dead ones are removed.
[[nodiscard]] std::vector<LinkStatus> read_link_statuses(const std::string& folder);

}  // namespace farfeel::transport
