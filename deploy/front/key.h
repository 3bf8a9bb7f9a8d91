// `farfeel key`: this machine's key, and whom it trusts.
#pragma once

namespace farfeel::front {

/// argv[0] is "key". Returns the exit status: 0 done, 1 something failed, another number where the words make no sense.
[[nodiscard]] int key_command(int argc, char** argv);

}  // namespace farfeel::front
