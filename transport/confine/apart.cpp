// Question: its bytes, then the end of the stream. Answer: one byte, kAnswer or kReason, then its bytes, and the end.

#include "transport/confine/apart.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <new>
#include <optional>
#include <string_view>

#include "transport/confine/calls.h"

extern char** environ;

namespace farfeel::transport {
namespace {

constexpr std::byte kAnswer{1}, kReason{2};
constexpr std::size_t kReasonBytesMax = 400;
constexpr std::size_t kPiece = std::size_t{1} << 18;
constexpr int kLastWord_ms = 1000;  // from the end of the answer to the end of the process

tl::unexpected<std::string> no(std::string why) {
  return tl::unexpected(std::move(why));
}

/// The process; killed, if it has not been waited for.
class Process {
 public:
  explicit Process(pid_t pid) : pid_(pid) {}
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    (void)wait();
  }
  /// Its status; nothing where somebody else took it. Who has closed the line and does not end is ended.
  std::optional<int> wait() {
    int status = 0;
    pid_t got = 0;
    for (int ms = 0; (got = ::waitpid(pid_, &status, WNOHANG)) == 0; ++ms) {
      if (ms == kLastWord_ms) ::kill(pid_, SIGKILL);
      (void)::poll(nullptr, 0, 1);
    }
    pid_ = 0;
    return got > 0 ? std::optional(status) : std::nullopt;
  }

 private:
  pid_t pid_;
};

class Socket {
 public:
  explicit Socket(int fd) : fd_(fd) {}
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() { close(); }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

/// With `theirs` as descriptors 0 and 1, nothing else but 2, and no signal blocked. 0 or an errno.
int spawn(std::vector<std::string>& program, int theirs, pid_t& pid) {
  std::vector<char*> arguments;
  for (std::string& argument : program) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_adddup2(&actions, theirs, 0);
  posix_spawn_file_actions_adddup2(&actions, theirs, 1);
  posix_spawn_file_actions_addclosefrom_np(&actions, 3);
  // An ordinary process whoever asks, also a real-time thread; in a group of its own, so that Ctrl-C is the asker's.
  const sched_param ordinary{};
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setschedpolicy(&attributes, SCHED_OTHER);
  posix_spawnattr_setschedparam(&attributes, &ordinary);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(
      &attributes, static_cast<short>(POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSCHEDULER | POSIX_SPAWN_SETPGROUP));
  const int error = ::posix_spawn(&pid, arguments[0], &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return error;
}

enum class Talk : std::uint8_t { kDone, kTooLong, kLate, kBroken };

/// Sends the question and takes what comes, until the other side has closed.
Talk talk(int fd, std::span<const std::byte> question, std::vector<std::byte>& answer, const ApartLimits& limits) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::seconds(limits.seconds);
  std::vector<std::byte> piece(kPiece);
  bool is_sending = true;
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0) return Talk::kLate;
    pollfd one{fd, static_cast<short>(is_sending ? POLLIN | POLLOUT : POLLIN), 0};
    if (::poll(&one, 1, static_cast<int>(std::min<std::int64_t>(left, 1000))) < 0 && errno != EINTR)
      return Talk::kBroken;
    if (is_sending && (one.revents & POLLOUT) != 0) {
      const ssize_t sent = ::send(fd, question.data(), std::min(question.size(), kPiece), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent > 0) question = question.subspan(static_cast<std::size_t>(sent));
      // Whoever does not listen to the end may still have said why.
      if (question.empty() || (sent < 0 && errno != EAGAIN && errno != EINTR)) {
        ::shutdown(fd, SHUT_WR);
        is_sending = false;
      }
    }
    if ((one.revents & (POLLIN | POLLHUP | POLLERR)) != 0) {
      const ssize_t got = ::recv(fd, piece.data(), piece.size(), MSG_DONTWAIT);
      if (got == 0) return Talk::kDone;
      if (got < 0 && errno == ECONNRESET) return Talk::kDone;
      if (got < 0 && errno != EAGAIN && errno != EINTR) return Talk::kBroken;
      if (got <= 0) continue;
      if (static_cast<std::size_t>(got) > limits.answer_bytes + 1 - answer.size()) return Talk::kTooLong;
      answer.insert(answer.end(), piece.begin(), piece.begin() + got);
    }
  }
}

std::string printable(std::span<const std::byte> bytes) {
  std::string text;
  for (const std::byte b : bytes.first(std::min(bytes.size(), kReasonBytesMax))) {
    const char c = static_cast<char>(b);
    text += c >= 0x20 && c < 0x7F ? c : '?';
  }
  return text;
}

std::string obituary(int status) {
  if (WIFEXITED(status)) return fmt::format("the process that decodes ended with status {}", WEXITSTATUS(status));
  const int signal = WTERMSIG(status);
  if (signal == SIGSYS) return "the process that decodes was ended because it asked the kernel for what it may not";
  if (signal == SIGXCPU) return "it takes longer than allowed";
  if (signal == SIGKILL) return "the process that decodes was killed";
  return fmt::format("the process that decodes crashed ({})", ::strsignal(signal));
}

bool write_all(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return true;
}

int say(std::byte what, std::span<const std::byte> bytes) {
  return write_all(std::span(&what, 1)) && write_all(bytes) ? 0 : 1;
}
int say_reason(std::string_view why) {
  return say(kReason, std::as_bytes(std::span(why.substr(0, kReasonBytesMax))));
}

std::optional<std::uint64_t> number_in(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

void limit(int resource, rlim_t soft, rlim_t hard) {
  const rlimit both{soft, hard};
  (void)::setrlimit(static_cast<__rlimit_resource_t>(resource), &both);  // lowering never fails
}

}  // namespace

tl::expected<std::vector<std::byte>, std::string> ask_apart(std::vector<std::string> program,
                                                            std::span<const std::byte> question,
                                                            const ApartLimits& limits) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    return no(fmt::format("no pair of sockets: {}", std::strerror(errno)));
  const Socket ours(ends[0]);
  Socket theirs(ends[1]);
  program.push_back(std::to_string(limits.memory_bytes));
  program.push_back(std::to_string(limits.seconds));
  pid_t pid = 0;
  if (const int error = spawn(program, theirs.get(), pid); error != 0)
    return no(fmt::format("cannot start {}: {}", program[0], std::strerror(error)));
  Process process(pid);
  theirs.close();
  std::vector<std::byte> answer;
  switch (talk(ours.get(), question, answer, limits)) {
    case Talk::kLate:
      return no(fmt::format("it takes longer than the {} s that are allowed", limits.seconds));
    case Talk::kTooLong:
      return no(fmt::format("the answer is larger than the {} bytes that are allowed", limits.answer_bytes));
    case Talk::kBroken:
      return no(fmt::format("the process that decodes is not heard: {}", std::strerror(errno)));
    case Talk::kDone:
      break;
  }
  const auto status = process.wait();
  if (status && *status != 0) return no(obituary(*status));
  if (!answer.empty() && answer[0] == kReason) return no(printable(std::span(answer).subspan(1)));
  if (answer.empty() || answer[0] != kAnswer) return no("the process that decodes said nothing");
  answer.erase(answer.begin());
  return answer;
}

int answer_apart(std::span<char* const> arguments, const Answer& answer) {
  if (arguments.size() < 2) return 2;
  const auto memory_bytes = number_in(arguments[arguments.size() - 2]), seconds = number_in(arguments.back());
  if (!memory_bytes || !seconds) return 2;
#ifndef FARFEEL_SANITIZED  // sanitizers reserve terabytes of addresses
  limit(RLIMIT_AS, *memory_bytes, *memory_bytes);
#endif
  limit(RLIMIT_CPU, *seconds, *seconds + 1);  // SIGXCPU, which says why, before SIGKILL, which does not
  limit(RLIMIT_CORE, 0, 0);
  // Where there is no seccomp the limits hold all the same. The asker's log is descriptor 2.
  if (const auto done = restrict_calls(Calls::kAnswerer); !done)
    fmt::print(stderr, "the process that decodes runs without a filter: {}\n", done.error());
  try {
    std::vector<std::byte> question;
    for (;;) {
      const std::size_t size = question.size();
      question.resize(size + kPiece);
      const ssize_t n = ::read(STDIN_FILENO, question.data() + size, kPiece);
      if (n < 0 && errno != EINTR) return 1;
      question.resize(size + static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
      if (n == 0) break;
    }
    const auto said = answer(question);
    return said ? say(kAnswer, *said) : say_reason(said.error());
  } catch (const std::bad_alloc&) {
    return say_reason(
        fmt::format("it takes more than the {} MB of memory that are allowed", *memory_bytes / 1'000'000));
  }
}

}  // namespace farfeel::transport
