// What asks a program to end, and how it goes on without the terminal that it was started on.
#pragma once

#include <csignal>

namespace farfeel::codecs {

/// Holds Ctrl-C, SIGTERM and, unless it is ignored (nohup), SIGHUP back from this and every later thread, to be waited
/// for; and returns them.
sigset_t hold_stop_signals();

/// "Ctrl-C", "SIGTERM" or "a hang-up of the terminal".
[[nodiscard]] const char* stop_in_words(int signal);

/// After SIGHUP the terminal is gone: what would be said there goes nowhere, and stops nobody. Else does nothing.
void leave_terminal_after(int signal);

}  // namespace farfeel::codecs
