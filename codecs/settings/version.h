// Which program this is, and on what it runs: for whoever is asked what went wrong.
#pragma once

#include <string>
#include <string_view>

namespace farfeel::codecs {

/// Three lines without the last line's end: name and version with commit, build and compiler; the kernel; the
/// instruction set that the fast kernels take here.
[[nodiscard]] std::string version_text(std::string_view program);

}  // namespace farfeel::codecs
