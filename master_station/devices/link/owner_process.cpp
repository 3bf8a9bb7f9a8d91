#include "master_station/devices/link/owner_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>

#include "haptic_core/realtime/periodic_loop.h"

extern char** environ;  // posix_spawn's

namespace farfeel::devices {
namespace {

constexpr int kLinkDescriptor = 3;                  // in the child
constexpr std::int64_t kPatience_ns = 500'000'000;  // for an owner that was asked to end: it takes force off in 1 ms
constexpr std::int64_t kLook_ns = 5'000'000;

std::string beside_this_program() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / "farfeel-device";
}

}  // namespace

tl::expected<void, std::string> OwnerProcess::spawn() {
  const std::string program = options_.program.empty() ? beside_this_program() : options_.program;
  const std::string link_number = std::to_string(kLinkDescriptor), station = std::to_string(getpid());
  std::vector<const char*> arguments{program.c_str(),     "serve",     "--link-fd",
                                     link_number.c_str(), "--station", station.c_str()};
  for (const std::string& argument : options_.arguments) arguments.push_back(argument.c_str());
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  const int link = fcntl(link_->fd(), F_DUPFD_CLOEXEC, 10);  // so that it is another number there, and stays open
  posix_spawn_file_actions_adddup2(&files, link, kLinkDescriptor);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  // A group of its own: Ctrl-C in a terminal ends the station, which ends this in order. No signal blocked.
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  const int failed =
      posix_spawn(&pid_, program.c_str(), &files, &attributes, const_cast<char* const*>(arguments.data()), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  ::close(link);
  if (failed == 0) return {};
  pid_ = -1;
  return tl::unexpected(
      fmt::format("could not start {}, which drives devices: {}; build it with 'cmake --build --preset "
                  "release --target programs', or use --device simulated",
                  program, std::strerror(failed)));
}

tl::expected<OwnerProcess, std::string> OwnerProcess::start(const Options& options) {
  auto link = MappedLink::create();
  if (!link) return tl::unexpected(link.error());
  OwnerProcess process(options, *std::move(link));
  if (auto spawned = process.spawn(); !spawned) return tl::unexpected(spawned.error());
  return process;
}

OwnerProcess::~OwnerProcess() {
  if (!link_ || pid_ < 0) return;
  ::kill(pid_, SIGTERM);
  const std::int64_t until_ns = realtime::monotonic_now_ns() + kPatience_ns;
  while (::waitpid(pid_, nullptr, WNOHANG) == 0) {
    const std::int64_t now_ns = realtime::monotonic_now_ns();
    if (now_ns > until_ns) ::kill(pid_, SIGKILL);
    realtime::wait_until(now_ns + kLook_ns, 0);
  }
}

std::string OwnerProcess::look(std::int64_t now_ns) {
  int status = 0;
  if (pid_ >= 0 && ::waitpid(pid_, &status, WNOHANG) == pid_) {
    pid_ = -1;
    ended_ns_ = now_ns;
    return WIFSIGNALED(status)
               ? fmt::format("farfeel-device was killed by signal {} ({}); force is off, it is started again",
                             WTERMSIG(status), ::strsignal(WTERMSIG(status)))
               : fmt::format("farfeel-device ended with status {}; force is off, it is started again",
                             WEXITSTATUS(status));
  }
  if (pid_ >= 0 || now_ns - ended_ns_ < kAgain_ns) return {};
  ended_ns_ = now_ns;
  const auto spawned = spawn();
  return spawned ? std::string() : spawned.error();
}

OpenedDevice OwnerProcess::opened() const noexcept {
  OpenedDevice opened;
  static_cast<void>(memory().opened.load(opened));
  return opened;
}

Sample OwnerProcess::newest() const noexcept {
  Sample sample;
  static_cast<void>(memory().sample.load(sample));
  return sample;
}

std::string OwnerProcess::advice() const {
  FixedText<512> text;
  static_cast<void>(memory().advice.load(text));
  return text.text();
}

}  // namespace farfeel::devices
