#include "codecs/settings/stop_signals.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <ctime>
#include <initializer_list>

namespace farfeel::codecs {

sigset_t hold_stop_signals() {
  sigset_t stops;
  sigemptyset(&stops);
  sigaddset(&stops, SIGINT);
  sigaddset(&stops, SIGTERM);
  struct sigaction hang_up {};
  if (::sigaction(SIGHUP, nullptr, &hang_up) == 0 && hang_up.sa_handler != SIG_IGN) sigaddset(&stops, SIGHUP);
  ::pthread_sigmask(SIG_BLOCK, &stops, nullptr);
  return stops;
}

const char* stop_in_words(int signal) {
  return signal == SIGINT ? "Ctrl-C" : signal == SIGHUP ? "a hang-up of the terminal" : "SIGTERM";
}

void leave_terminal_after(int signal) {
  if (signal != SIGHUP) return;
  const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    struct stat what = {};
    const bool is_terminal = ::fstat(stream, &what) == 0 && S_ISCHR(what.st_mode);  // isatty() says no once it hung up
    if (nothing >= 0 && is_terminal) ::dup2(nothing, stream);
  }
  if (nothing >= 0) ::close(nothing);
}

StopsEndAtOnce::StopsEndAtOnce(const sigset_t& held)
    : thread_([held](const std::stop_token& is_over) {
        constexpr timespec kLook{0, 20'000'000};
        while (!is_over.stop_requested()) {
          const int signal = ::sigtimedwait(&held, nullptr, &kLook);
          if (signal < 0) continue;
          ::signal(signal, SIG_DFL);
          ::pthread_sigmask(SIG_UNBLOCK, &held, nullptr);
          ::raise(signal);
        }
      }) {}

}  // namespace farfeel::codecs
