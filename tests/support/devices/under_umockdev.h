// Tests whose /dev and /sys are umockdev's: the libraries that talk to devices are Debian's own, and what they open is
// emulated in this process.
#pragma once

#include <string>

namespace farfeel::test_support {

/// Runs this program again with umockdev's library preloaded, unless it is; call it first in main(). Returns where that
/// is done, or cannot be.
void enter_umockdev(char** argv);

/// Empty: /dev and /sys are umockdev's. Else why not, for GTEST_SKIP.
[[nodiscard]] std::string why_not_under_umockdev();

/// The calling thread is an ordinary one towards file permissions from now on, even root's.
void respect_permissions();

}  // namespace farfeel::test_support
