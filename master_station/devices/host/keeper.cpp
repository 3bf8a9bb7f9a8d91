#include "master_station/devices/host/keeper.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usbdevice_fs.h>
#include <signal.h>
#include <spawn.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <vector>

#include "haptic_core/realtime/periodic_loop.h"

extern char** environ;  // posix_spawn's

namespace farfeel::devices {
namespace {

constexpr std::int64_t kLook_ns = 1'000'000;
constexpr std::int64_t kAfter_ns =
    20'000'000;  // zero force is sent for so long after an owner's death: one may be lost
constexpr unsigned kUsbTimeout_ms = 5;
constexpr int kPriority = 50;  // above the owner's: it has to run when that one does not
constexpr const char* kAsked = "keep-force-off";
constexpr int kLinkDescriptor = 3, kDeviceDescriptor = 4;  // in the keeper

/// Moves descriptors to their places in the child. A duplicate made first keeps one from closing the other.
struct Actions {
  posix_spawn_file_actions_t actions;
  Actions() { posix_spawn_file_actions_init(&actions); }
  ~Actions() { posix_spawn_file_actions_destroy(&actions); }
  Actions(const Actions&) = delete;
  Actions& operator=(const Actions&) = delete;
};

std::string hexadecimal(std::span<const std::byte> bytes) {
  std::string text;
  for (const std::byte b : bytes) text += fmt::format("{:02x}", std::to_integer<unsigned>(b));
  return text;
}

bool read_bytes(std::string_view text, ZeroForce& zero) {
  if (text.size() % 2 != 0 || text.size() / 2 > zero.bytes.size()) return false;
  for (std::size_t i = 0; i < text.size() / 2; ++i) {
    const std::string pair(text.substr(2 * i, 2));
    zero.bytes[i] = static_cast<std::byte>(std::strtoul(pair.c_str(), nullptr, 16));
  }
  zero.size = text.size() / 2;
  return true;
}

}  // namespace

bool send(const ZeroForce& zero) noexcept {
  if (zero.how == ZeroForce::How::kWrite)
    return ::write(zero.fd, zero.bytes.data(), zero.size) == static_cast<ssize_t>(zero.size);
  std::array<std::byte, sizeof(ZeroForce::bytes)> bytes = zero.bytes;  // the kernel's structure wants it writable
  usbdevfs_bulktransfer transfer{};
  transfer.ep = zero.endpoint;
  transfer.len = static_cast<unsigned>(zero.size);
  transfer.timeout = kUsbTimeout_ms;
  transfer.data = bytes.data();
  return ::ioctl(zero.fd, USBDEVFS_BULK, &transfer) == static_cast<int>(zero.size);
}

int keep(LinkMemory& memory, const ZeroForce& zero, pid_t owner) noexcept {
  bool is_silent = false;
  std::int64_t dead_since_ns = 0;
  for (realtime::Deadlines looks(realtime::monotonic_now_ns(), kLook_ns);;
       looks.advance(realtime::monotonic_now_ns())) {
    const std::int64_t now_ns = realtime::wait_until(looks.current_ns(), 0);
    memory.keeper_beat_ns.store(now_ns, std::memory_order_relaxed);
    // A dead owner's children get another parent.
    if (dead_since_ns == 0 && getppid() != owner) dead_since_ns = now_ns;
    const std::int64_t beat_ns = memory.owner_beat_ns.load(std::memory_order_relaxed);
    const bool has_ended_well = beat_ns == 0;
    const bool was_silent = is_silent;
    is_silent = !has_ended_well && (dead_since_ns != 0 || now_ns - beat_ns > kOwnerSilent_ns);
    if (is_silent) {
      if (!was_silent) memory.taken_off.fetch_add(1, std::memory_order_relaxed);
      send(zero);
    }
    if (dead_since_ns != 0 && (has_ended_well || now_ns - dead_since_ns > kAfter_ns)) return 0;
  }
}

tl::expected<Keeper, std::string> Keeper::start(int link_fd, const ZeroForce& zero) {
  const std::string how = zero.how == ZeroForce::How::kUsbBulk ? "usb" : "write",
                    endpoint = std::to_string(zero.endpoint),
                    bytes = hexadecimal(std::span(zero.bytes).first(zero.size)), owner = std::to_string(getpid());
  std::vector<const char*> arguments{"farfeel-device", kAsked,        how.c_str(), endpoint.c_str(),
                                     bytes.c_str(),    owner.c_str(), nullptr};
  const int link = fcntl(link_fd, F_DUPFD_CLOEXEC, 10), device = fcntl(zero.fd, F_DUPFD_CLOEXEC, 10);
  Actions files;
  posix_spawn_file_actions_adddup2(&files.actions, link, kLinkDescriptor);
  posix_spawn_file_actions_adddup2(&files.actions, device, kDeviceDescriptor);
  pid_t pid = -1;
  const int failed = link < 0 || device < 0 ? EBADF
                                            : posix_spawn(&pid, "/proc/self/exe", &files.actions, nullptr,
                                                          const_cast<char* const*>(arguments.data()), environ);
  if (link >= 0) ::close(link);
  if (device >= 0) ::close(device);
  if (failed != 0)
    return tl::unexpected(fmt::format("could not start the process that takes force off: {}", std::strerror(failed)));
  return Keeper(pid);
}

Keeper::~Keeper() {
  if (pid_ < 0) return;
  ::kill(pid_, SIGKILL);  // it holds nothing that would have to be put away
  ::waitpid(pid_, nullptr, 0);
}

bool Keeper::has_ended() noexcept {
  if (pid_ >= 0 && ::waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = -1;
  return pid_ < 0;
}

std::optional<int> keep_if_asked(std::span<char* const> arguments) {
  constexpr std::size_t kArguments = 6;
  if (arguments.size() != kArguments || std::string_view(arguments[1]) != kAsked) return std::nullopt;
  // A terminal's Ctrl-C reaches the whole group: the owner ends in order, and tells its keeper by its beat.
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) ::signal(number, SIG_IGN);
  ZeroForce zero;
  zero.fd = kDeviceDescriptor;
  zero.how = std::string_view(arguments[2]) == "usb" ? ZeroForce::How::kUsbBulk : ZeroForce::How::kWrite;
  zero.endpoint = static_cast<std::uint8_t>(std::strtoul(arguments[3], nullptr, 10));
  const auto owner = static_cast<pid_t>(std::strtol(arguments[5], nullptr, 10));
  auto link = MappedLink::open(kLinkDescriptor);
  if (!link || !read_bytes(arguments[4], zero)) return 1;
  realtime::use_fifo(kPriority);
  realtime::lock_memory();
  return keep(link->memory(), zero, owner);
}

}  // namespace farfeel::devices
