// A piece of a test in a process of its own: what it gives up there, the test keeps.
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <functional>
#include <string>

namespace farfeel::test_support {

struct Outcome {
  int status = -1;    ///< as waitpid tells it
  std::string words;  ///< what the work gave back
  [[nodiscard]] bool ended() const { return WIFEXITED(status) && WEXITSTATUS(status) == 0; }
  [[nodiscard]] int signal() const { return WIFSIGNALED(status) ? WTERMSIG(status) : 0; }
};

/// Forks, works, and tells. The test has one thread meanwhile.
inline Outcome in_child(const std::function<std::string()>& work) {
  int pipe_of[2];
  if (::pipe(pipe_of) != 0) return {};
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::close(pipe_of[0]);
    const std::string words = work();
    _exit(::write(pipe_of[1], words.data(), words.size()) == static_cast<ssize_t>(words.size()) ? 0 : 1);
  }
  ::close(pipe_of[1]);
  Outcome outcome;
  char bytes[4096];
  for (ssize_t n = 0; (n = ::read(pipe_of[0], bytes, sizeof bytes)) > 0;)
    outcome.words.append(bytes, static_cast<std::size_t>(n));
  ::close(pipe_of[0]);
  ::waitpid(pid, &outcome.status, 0);
  return outcome;
}

}  // namespace farfeel::test_support
