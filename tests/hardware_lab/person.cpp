#include "tests/hardware_lab/person.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <pty.h>
#include <sched.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

namespace farfeel::hardware_lab {
namespace {

constexpr uid_t kUser = 1000;                                   // guest/passwd
constexpr gid_t kPlugdev = 46;                                  // guest/group
constexpr rlim_t kRealTime = 90;                                // as a limits.conf of a machine for haptics would allow
constexpr int kPatience_ms = 5000;                              // after SIGTERM
constexpr std::chrono::milliseconds kFirst{500}, kRepeats{40};  // of a keyboard, whose key is held

[[noreturn]] void become_person(const std::vector<std::string>& command, const std::string& log, int terminal) {
  const sched_param ordinary{};
  sched_setscheduler(0, SCHED_OTHER, &ordinary);
  const rlimit real_time{kRealTime, kRealTime}, locked{RLIM_INFINITY, RLIM_INFINITY};
  setrlimit(RLIMIT_RTPRIO, &real_time);
  setrlimit(RLIMIT_MEMLOCK, &locked);
  const int fd = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  dup2(fd, STDOUT_FILENO), dup2(fd, STDERR_FILENO);
  dup2(terminal, STDIN_FILENO);
  setenv("HOME", "/home/lab", 1);
  if (setgroups(1, &kPlugdev) != 0 || setgid(kUser) != 0 || setuid(kUser) != 0 || chdir("/home/lab") != 0) _exit(126);
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  execvp(arguments.front(), arguments.data());
  _exit(127);
}

std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// The field's first word in /proc/PID/status.
std::string status_field(pid_t pid, const std::string& field) {
  std::istringstream lines(text_of(fmt::format("/proc/{}/status", pid)));
  std::string key, value;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    if (words >> key >> value && key == field + ":") return value;
  }
  return {};
}

}  // namespace

PersonsProgram::PersonsProgram(const std::vector<std::string>& command, const std::string& log) : log_(log) {
  int terminal = -1;
  if (openpty(&keyboard_, &terminal, nullptr, nullptr, nullptr) != 0) fmt::print(stderr, "there is no terminal\n");
  fcntl(keyboard_, F_SETFD, FD_CLOEXEC), fcntl(terminal, F_SETFD, FD_CLOEXEC);
  fcntl(keyboard_, F_SETFL, O_NONBLOCK);  // what nobody reads is lost
  pid_ = fork();
  if (pid_ == 0) become_person(command, log, terminal);
  close(terminal);
}

PersonsProgram::~PersonsProgram() {
  end();
  hold_key(false);
  close(keyboard_);
}

void PersonsProgram::hold_key(bool is_held) {
  key_ = {};
  if (!is_held) return;
  key_ = std::jthread([this](const std::stop_token& is_let_go) {
    for (auto next = std::chrono::steady_clock::now(), first = next; !is_let_go.stop_requested();) {
      if (std::chrono::steady_clock::now() >= next) {
        [[maybe_unused]] const ssize_t typed = write(keyboard_, " ", 1);
        next += next == first ? kFirst : kRepeats;
      }
      std::this_thread::sleep_for(kRepeats / 4);
    }
  });
}

bool PersonsProgram::is_running() {
  if (pid_ > 0 && waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = -1;
  return pid_ > 0;
}

std::string PersonsProgram::printed() const {
  return text_of(log_);
}

void PersonsProgram::end() {
  if (!is_running()) return;
  kill(pid_, SIGTERM);
  for (int i = 0; i < kPatience_ms && is_running(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (!is_running()) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

std::optional<pid_t> child_running(pid_t parent, const std::string& program) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    pid_t pid = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), pid);
    if (error != std::errc() || end != name.data() + name.size()) continue;
    // The kernel keeps 15 letters of a name.
    if (status_field(pid, "Name") == program.substr(0, 15) && status_field(pid, "PPid") == std::to_string(parent)) {
      return pid;
    }
  }
  return std::nullopt;
}

bool is_unprivileged(pid_t pid) {
  return status_field(pid, "Uid") == std::to_string(kUser) && status_field(pid, "CapEff") == "0000000000000000" &&
         status_field(pid, "CapPrm") == "0000000000000000";
}

std::optional<devices::MappedLink> link_of(pid_t device) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(fmt::format("/proc/{}/fd", device), error)) {
    const auto target = std::filesystem::read_symlink(entry.path(), error);
    if (target.string().find("memfd:") == std::string::npos) continue;
    const int fd = open(entry.path().c_str(), O_RDWR | O_CLOEXEC);
    if (fd < 0) continue;
    if (auto link = devices::MappedLink::open(fd)) return std::move(*link);
  }
  return std::nullopt;
}

}  // namespace farfeel::hardware_lab
