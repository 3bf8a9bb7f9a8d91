#include "tests/end_to_end/faults/processes.h"

#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>

namespace farfeel::end_to_end {

Calm::Calm() {
  const sched_param least{.sched_priority = 1};
  sched_setscheduler(0, SCHED_RR, &least);
}

Calm::~Calm() {
  const sched_param none{};
  sched_setscheduler(0, SCHED_OTHER, &none);
}

OtherProcess::OtherProcess(const std::string& program, std::vector<std::string> arguments) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  arguments.insert(arguments.begin(), program);
  arguments.insert(arguments.end(), {"--tell", std::to_string(ends[1])});
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) {
    ::close(ends[0]);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    execv(program.c_str(), argv.data());
    _exit(127);
  }
  ::close(ends[1]);
  from_ = ends[0];
}

OtherProcess::~OtherProcess() {
  kill9();
  ::close(from_);
}

void OtherProcess::stop() const {
  kill(pid_, SIGSTOP);
}

void OtherProcess::go_on() const {
  kill(pid_, SIGCONT);
}

void OtherProcess::kill9() {
  if (pid_ <= 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

bool OtherProcess::hear(void* to, std::size_t bytes, double patience_s) const {
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience_s);
  auto* at = static_cast<char*>(to);
  while (bytes > 0) {
    const auto left = std::chrono::duration<double, std::milli>(until - std::chrono::steady_clock::now()).count();
    pollfd one{from_, POLLIN, 0};
    if (left <= 0 || poll(&one, 1, static_cast<int>(left) + 1) <= 0) return false;
    const ssize_t got = read(from_, at, bytes);
    if (got <= 0) return false;
    at += got;
    bytes -= static_cast<std::size_t>(got);
  }
  return true;
}

}  // namespace farfeel::end_to_end
