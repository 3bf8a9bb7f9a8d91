#include "master_station/devices/channel/hidapi_channel.h"

#include <fcntl.h>
#include <hidapi.h>
#include <poll.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "codecs/device/hid_report_descriptor.h"
#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::devices {
namespace {

constexpr int kNodeFlags = O_RDWR | O_NONBLOCK | O_CLOEXEC;
// Somebody who only looks whether the device is taken holds its lock for an instant.
constexpr int kLockTries = 5;
constexpr useconds_t kLockPause_us = 10'000;

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

std::string why_not_opened(const std::string& path, int error) {
  switch (error) {
    case EACCES:
    case EPERM:
      return "no permission for " + path +
             ": install deploy/udev/70-farfeel.rules, which gives the device to whoever sits at this machine, and plug "
             "the device in again";
    case EBUSY:
    case EWOULDBLOCK:
      return path + " is taken: another program talks to the device; end that one";
    case ENOENT:
    case ENODEV:
    case ENXIO:
    case EIO:
      return path + " is gone: plug the device in again";
    default:
      return "cannot open " + path + ": " + std::strerror(error);
  }
}

// Whether the lock is ours now; false with errno.
bool lock(int fd) {
  for (int i = 0; i < kLockTries; ++i) {
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0) return true;
    if (errno != EWOULDBLOCK) return false;
    ::usleep(kLockPause_us);
  }
  errno = EWOULDBLOCK;
  return false;
}

std::string trouble_of(const std::string& path) {
  const Descriptor node(::open(path.c_str(), kNodeFlags));
  if (node.get() < 0 || ::flock(node.get(), LOCK_SH | LOCK_NB) != 0) return why_not_opened(path, errno);
  return {};
}

std::string printable(const wchar_t* text) {
  std::string ascii;
  for (; text != nullptr && *text != L'\0'; ++text) {
    if (*text > L' ' && *text < L'\x7F') ascii += static_cast<char>(*text);
  }
  return ascii;
}

bool is_gone(int error) {
  return error == ENODEV || error == ENXIO || error == EIO || error == ESHUTDOWN;
}

// Returns once there is something to read, or the device is gone, or at the deadline.
void wait_to_read(int fd, std::int64_t wait_ns) {
  pollfd readable{fd, POLLIN, 0};
  const timespec wait{static_cast<time_t>(wait_ns / 1'000'000'000), static_cast<long>(wait_ns % 1'000'000'000)};
  ::ppoll(&readable, 1, &wait, nullptr);
}

}  // namespace

std::vector<FoundHid> find_hid_devices() {
  std::vector<FoundHid> found;
  hid_device_info* const all = hid_enumerate(0, 0);
  for (const hid_device_info* at = all; at != nullptr; at = at->next) {
    if (at->path == nullptr) continue;
    found.push_back({at->vendor_id, at->product_id, at->usage_page, at->usage, printable(at->serial_number), at->path,
                     trouble_of(at->path)});
  }
  hid_free_enumeration(all);
  return found;
}

std::vector<std::byte> report_descriptor_of(const std::string& path) {
  const std::string node = path.substr(path.rfind('/') + 1);
  const std::string file = "/sys/class/hidraw/" + node + "/device/report_descriptor";
  const Descriptor from(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  std::vector<std::byte> bytes(codecs::kMaxReportDescriptorBytes);
  std::size_t size = 0;
  while (from.get() >= 0 && size < bytes.size()) {
    const ssize_t n = ::read(from.get(), bytes.data() + size, bytes.size() - size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    size += static_cast<std::size_t>(n);
  }
  bytes.resize(size);
  return bytes;
}

tl::expected<std::unique_ptr<HidapiChannel>, std::string> HidapiChannel::open(const std::string& path) {
  Descriptor node(::open(path.c_str(), kNodeFlags));
  if (node.get() < 0 || !lock(node.get())) return tl::unexpected(why_not_opened(path, errno));
  hid_device* const features = hid_open_path(path.c_str());
  if (features == nullptr) {
    const wchar_t* const why = hid_error(nullptr);
    std::string text;
    for (const wchar_t* at = why; at != nullptr && *at != L'\0'; ++at)
      text += *at < 0x80 ? static_cast<char>(*at) : '?';
    return tl::unexpected("hidapi cannot open " + path + ": " + text);
  }
  return std::unique_ptr<HidapiChannel>(new HidapiChannel(features, node.release(), report_descriptor_of(path)));
}

HidapiChannel::HidapiChannel(hid_device* features, int fd, std::vector<std::byte> report_descriptor)
    : features_(features), fd_(fd), report_descriptor_(std::move(report_descriptor)) {
  const auto reports = codecs::read_report_descriptor(report_descriptor_);
  // Where nothing is known, bytes are passed on as they come: most devices number their reports.
  is_numbered_ = !reports || reports->reports.empty() || reports->is_numbered;
}

HidapiChannel::~HidapiChannel() {
  hid_close(features_);
  ::close(fd_);
}

Transferred HidapiChannel::read(std::span<std::byte> report, std::int64_t deadline_ns) noexcept {
  const std::size_t id_bytes = is_numbered_ ? 0 : 1;
  if (report.size() <= id_bytes) return {};
  if (!is_numbered_) report[0] = std::byte{0};
  while (true) {
    const ssize_t n = ::read(fd_, report.data() + id_bytes, report.size() - id_bytes);
    if (n > 0) return {ChannelState::kDone, static_cast<std::size_t>(n) + id_bytes};
    if (n == 0 || is_gone(errno)) return {ChannelState::kGone, 0};  // a node that lives has no end
    if (errno == EINTR) continue;
    if (errno != EAGAIN) return {ChannelState::kStalled, 0};
    const std::int64_t wait_ns = deadline_ns - realtime::monotonic_now_ns();
    if (wait_ns <= 0) return {ChannelState::kNothing, 0};
    wait_to_read(fd_, wait_ns);
  }
}

Transferred HidapiChannel::write(std::span<const std::byte> report) noexcept {
  ssize_t n = 0;
  do {
    n = ::write(fd_, report.data(), report.size());
  } while (n < 0 && errno == EINTR);
  if (n >= 0) return {ChannelState::kDone, static_cast<std::size_t>(n)};
  // EIO here is a transfer that failed: whether the device is gone, the next read tells.
  const bool is_unplugged = errno == ENODEV || errno == ENXIO || errno == ESHUTDOWN;
  return {is_unplugged ? ChannelState::kGone : ChannelState::kStalled, 0};
}

Transferred HidapiChannel::get_feature(std::span<std::byte> report) noexcept {
  const int n = hid_get_feature_report(features_, reinterpret_cast<unsigned char*>(report.data()), report.size());
  if (n < 0) return {is_gone(errno) ? ChannelState::kGone : ChannelState::kStalled, 0};
  return {ChannelState::kDone, static_cast<std::size_t>(n)};
}

Transferred HidapiChannel::set_feature(std::span<const std::byte> report) noexcept {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(report.data());
  const int n = hid_send_feature_report(features_, bytes, report.size());
  if (n < 0) return {is_gone(errno) ? ChannelState::kGone : ChannelState::kStalled, 0};
  return {ChannelState::kDone, static_cast<std::size_t>(n)};
}

}  // namespace farfeel::devices
