#include "deploy/front/elapsed.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace farfeel::front {
namespace {

constexpr int kLine_s = 8;

[[noreturn]] void say_for_ever(const std::string& what) {
  const bool is_terminal = ::isatty(STDERR_FILENO) != 0;
  for (int seconds = 1;; ++seconds) {
    ::sleep(1);
    if (is_terminal)
      fmt::print(stderr, "\r  {} s\r", seconds);
    else if (seconds % kLine_s == 0)
      fmt::print(stderr, "  {} s: {}\n", seconds, what);
  }
}

}  // namespace

Elapsed::Elapsed(const std::string& what) {
  const pid_t told = ::getpid();
  pid_ = ::fork();
  if (pid_ != 0) return;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != told) ::_exit(0);  // it ended before that
  ::close(STDIN_FILENO);
  ::close(STDOUT_FILENO);  // who reads it waits for its end
  say_for_ever(what);
}

Elapsed::~Elapsed() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

}  // namespace farfeel::front
