// What asks a program to end, and how it goes on without the terminal that it was started on.
#pragma once

#include <csignal>
#include <thread>

namespace farfeel::codecs {

/// Holds Ctrl-C, SIGTERM and, unless it is ignored (nohup), SIGHUP back from this and every later thread, to be waited
/// for; and returns them.
sigset_t hold_stop_signals();

/// "Ctrl-C", "SIGTERM" or "a hang-up of the terminal".
[[nodiscard]] const char* stop_in_words(int signal);

/// After SIGHUP the terminal is gone: what would be said there goes nowhere, and stops nobody. Else does nothing.
void leave_terminal_after(int signal);

/// While it lives a stop ends the program at once, as if it were not held: as long as there is nothing to put in order.
/// Afterwards stops wait again.
class StopsEndAtOnce {
 public:
  explicit StopsEndAtOnce(const sigset_t& held);  ///< by every thread

 private:
  std::jthread thread_;
};

}  // namespace farfeel::codecs
