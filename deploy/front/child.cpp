#include "deploy/front/child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <deque>
#include <filesystem>
#include <fstream>

namespace farfeel::front {
namespace {

constexpr int kReadyDescriptor = 3;  // in the child
constexpr std::size_t kLastLines = 8;

tl::unexpected<FrontError> failure(std::string message) {
  return tl::unexpected(FrontError{std::move(message)});
}

struct Pipe {
  Descriptor read, write;
};

tl::expected<Pipe, FrontError> make_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0)
    return failure(fmt::format("could not make a pipe: {}", std::strerror(errno)));
  return Pipe{Descriptor(ends[0]), Descriptor(ends[1])};
}

// glibc 2.36 declares its own pidfd_open without C linkage.
int open_pidfd(pid_t pid) {
  return static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
}

// In the child, after fork: only calls that are safe between fork and exec.
[[noreturn]] void become(const char* program, char* const* arguments, int output, int log, int ready, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(1);  // the front died in between
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  // dup2 onto itself would leave close-on-exec set.
  if (ready == kReadyDescriptor) fcntl(ready, F_SETFD, 0);
  if (ready >= 0) dup2(ready, kReadyDescriptor);
  execv(program, arguments);
  _exit(127);
}

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

std::string own_folder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
}

tl::expected<std::string, FrontError> sibling(const std::string& name) {
  std::string path = own_folder() + "/" + name;
  if (access(path.c_str(), X_OK) == 0) return path;
  return failure(fmt::format("{} is not beside farfeel in {}; build it: cmake --build --preset release --target {}",
                             name, own_folder(), name));
}

tl::expected<Child, FrontError> Child::start(const std::string& program, std::vector<std::string> arguments,
                                             const std::string& log, Output output, bool has_ready) {
  Child child;
  child.name_ = std::filesystem::path(program).filename();
  child.log_ = log;
  const Descriptor log_file(open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (!log_file.is_open()) return failure(fmt::format("could not create {}: {}", log, std::strerror(errno)));
  auto output_pipe = make_pipe();
  auto ready_pipe = make_pipe();
  if (!output_pipe) return tl::unexpected(output_pipe.error());
  if (!ready_pipe) return tl::unexpected(ready_pipe.error());

  arguments.insert(arguments.begin(), program);
  if (has_ready) {
    arguments.push_back("--ready-fd");
    arguments.push_back(std::to_string(kReadyDescriptor));
  }
  std::vector<char*> raw;
  for (std::string& argument : arguments) raw.push_back(argument.data());
  raw.push_back(nullptr);

  const int child_output = output == Output::kIsRead ? output_pipe->write.number() : log_file.number();
  const int child_ready = has_ready ? ready_pipe->write.number() : -1;
  const pid_t parent = getpid();
  child.pid_ = fork();
  if (child.pid_ < 0) return failure(fmt::format("could not start {}: {}", program, std::strerror(errno)));
  if (child.pid_ == 0) become(program.c_str(), raw.data(), child_output, log_file.number(), child_ready, parent);
  setpgid(child.pid_, child.pid_);  // both do it, so that it holds whoever comes first
  child.ended_ = Descriptor(open_pidfd(child.pid_));
  if (output == Output::kIsRead) child.output_ = std::move(output_pipe->read);
  if (has_ready) child.ready_ = std::move(ready_pipe->read);
  return child;
}

Child::Child(Child&& other) noexcept
    : name_(std::move(other.name_)),
      log_(std::move(other.log_)),
      pid_(std::exchange(other.pid_, -1)),
      ended_(std::move(other.ended_)),
      output_(std::move(other.output_)),
      ready_(std::move(other.ready_)),
      wait_status_(other.wait_status_) {}

void Child::end() {
  if (pid_ < 0 || status()) return;
  signal(SIGTERM);
  pollfd ended{ended_fd(), POLLIN, 0};
  poll(&ended, 1, 1000);
  if (!status()) {
    signal(SIGKILL);
    poll(&ended, 1, -1);
    (void)status();
  }
}

tl::expected<int, FrontError> Child::ready_port(double timeout_s, int stop_fd,
                                                const std::function<void(int)>& while_waiting) const {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begun = Clock::now();
  std::string line;
  for (;;) {
    const double waited_s = std::chrono::duration<double>(Clock::now() - begun).count();
    if (waited_s >= timeout_s)
      return failure(fmt::format("{} was not ready within {} s; its log is {}", name_, timeout_s, log_));
    std::array<pollfd, 3> wait = {{{ready_.number(), POLLIN, 0}, {ended_fd(), POLLIN, 0}, {stop_fd, POLLIN, 0}}};
    const double wait_s = std::min(1.0, timeout_s - waited_s);
    if (poll(wait.data(), wait.size(), static_cast<int>(std::ceil(wait_s * 1000))) == 0) {
      if (while_waiting) while_waiting(static_cast<int>(waited_s + wait_s));
      continue;
    }
    if (wait[2].revents != 0) return failure("stopped");
    std::array<char, 128> bytes{};
    const ssize_t got = wait[0].revents != 0 ? read(ready_.number(), bytes.data(), bytes.size()) : 0;
    if (got <= 0) {
      pollfd ended{ended_fd(), POLLIN, 0};  // its end of the pipe closes before it is gone
      poll(&ended, 1, 1000);
      return failure(fmt::format("{} ended before it was ready", name_));
    }
    line.append(bytes.data(), static_cast<std::size_t>(got));
    int port = 0;
    if (line.find('\n') != std::string::npos && std::sscanf(line.c_str(), "ready %d", &port) == 1) return port;
    if (line.size() > 1000) return failure(fmt::format("{} said it was ready in words nobody understands", name_));
  }
}

void Child::signal(int number) const {
  if (!wait_status_) kill(-pid_, number);
}

std::optional<int> Child::status() {
  if (!wait_status_) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
    wait_status_ = status;
  }
  return WIFSIGNALED(*wait_status_) ? 128 + WTERMSIG(*wait_status_) : WEXITSTATUS(*wait_status_);
}

std::string Child::obituary() {
  std::string text;
  if (const auto code = status(); !code)
    text = fmt::format("{} is running", name_);
  else if (WIFSIGNALED(*wait_status_))
    text = fmt::format("{} was killed by signal {} ({})", name_, *code - 128, strsignal(*code - 128));
  else
    text = fmt::format("{} ended with status {}", name_, *code);

  std::ifstream log(log_);
  std::deque<std::string> last;
  for (std::string line; std::getline(log, line);) {
    last.push_back(line);
    if (last.size() > kLastLines) last.pop_front();
  }
  if (last.empty()) return text + " and said nothing\n";
  text += fmt::format("; the last lines of {}:\n", log_);
  for (const std::string& line : last) text += fmt::format("  | {}\n", line);
  return text;
}

}  // namespace farfeel::front
