// Files that are there whole or not at all.
#pragma once

#include <string>
#include <string_view>

namespace farfeel::codecs {

/// Puts `bytes` in place of the file, by way of a file beside it that is gone afterwards. Returns what went wrong, with
/// what to do about it; empty where all is written. Whatever was under the name before is then still there. A stop
/// signal for this thread waits until nothing is beside any more.
[[nodiscard]] std::string write_whole_file(const std::string& path, std::string_view bytes);

/// "could not write PATH: No space left on device: free some there, or ...", of an errno.
[[nodiscard]] std::string why_not_written(const std::string& path, int error);

}  // namespace farfeel::codecs
