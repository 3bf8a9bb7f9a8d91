// Files that may say which code runs and who is trusted: read only where nobody but their reader and root may write
// them.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <tl/expected.hpp>

namespace farfeel::codecs {

struct FileReader {
  uid_t user;
  bool is_under_sudo;  ///< root by somebody else's leave: that person's files are passed over
};
/// Who runs this process, by its effective user and SUDO_UID.
[[nodiscard]] FileReader this_reader();

/// The text of a file; nothing where there is none, or where it is passed over. An error, with the command that mends
/// it, where it is no plain file, too long, or where others than `reader` and root may write it or the folder that
/// holds it.
[[nodiscard]] tl::expected<std::optional<std::string>, std::string> read_trusted_file(const std::string& path,
                                                                                      const FileReader& reader);

}  // namespace farfeel::codecs
