#include "master_station/devices/channel/evdev_channel.h"

#include <fcntl.h>
#include <libevdev/libevdev.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::devices {
namespace {

class Node final : public EvdevChannel {
 public:
  explicit Node(int fd) : fd_(fd) {}
  ~Node() override {
    libevdev_free(device_);
    close(fd_);
  }

  /// 0, or an errno.
  int set_up() {
    if (const int result = libevdev_new_from_fd(fd_, &device_); result < 0) return -result;
    return -libevdev_set_clock_id(device_, CLOCK_MONOTONIC);
  }

  ChannelState read(input_event& event, std::int64_t deadline_ns) noexcept override {
    for (;;) {
      const unsigned flags = is_catching_up_ ? LIBEVDEV_READ_FLAG_SYNC : LIBEVDEV_READ_FLAG_NORMAL;
      const int result = libevdev_next_event(device_, flags, &event);
      if (result == LIBEVDEV_READ_STATUS_SYNC && !is_catching_up_) {
        is_catching_up_ = true;  // this event is SYN_DROPPED; next come the differences
        continue;
      }
      if (result == LIBEVDEV_READ_STATUS_SUCCESS || result == LIBEVDEV_READ_STATUS_SYNC) return ChannelState::kDone;
      if (result == -EAGAIN && is_catching_up_) {
        is_catching_up_ = false;
        continue;
      }
      if (result == -EINTR) continue;
      if (result != -EAGAIN) return ChannelState::kGone;
      const std::int64_t left_ns = deadline_ns - realtime::monotonic_now_ns();
      if (left_ns <= 0) return ChannelState::kNothing;
      pollfd waits{.fd = fd_, .events = POLLIN, .revents = 0};
      const timespec left{.tv_sec = left_ns / 1'000'000'000, .tv_nsec = left_ns % 1'000'000'000};
      const int ready = ppoll(&waits, 1, &left, nullptr);
      if (ready == 0) return ChannelState::kNothing;
      if (ready > 0 && (waits.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0 && (waits.revents & POLLIN) == 0)
        return ChannelState::kGone;
    }
  }

  ChannelState write(std::uint16_t type, std::uint16_t code, std::int32_t value) noexcept override {
    input_event event{};
    event.type = type, event.code = code, event.value = value;
    if (::write(fd_, &event, sizeof event) == static_cast<ssize_t>(sizeof event)) return ChannelState::kDone;
    return errno == ENODEV ? ChannelState::kGone : ChannelState::kStalled;
  }

  ChannelState upload(ff_effect& effect) noexcept override {
    if (ioctl(fd_, EVIOCSFF, &effect) == 0) return ChannelState::kDone;
    return errno == ENODEV ? ChannelState::kGone : ChannelState::kStalled;
  }

  [[nodiscard]] bool has(std::uint16_t type, std::uint16_t code) const noexcept override {
    return libevdev_has_event_code(device_, type, code) != 0;
  }
  [[nodiscard]] std::optional<input_absinfo> axis(std::uint16_t code) const noexcept override {
    const input_absinfo* const info = libevdev_get_abs_info(device_, code);
    return info != nullptr ? std::optional(*info) : std::nullopt;
  }
  [[nodiscard]] int descriptor() const noexcept override { return fd_; }

 private:
  int fd_;
  libevdev* device_ = nullptr;
  bool is_catching_up_ = false;
};

std::string line_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

/// A bit of a mask as sysfs prints it: hexadecimal words of `long`, the last holds bits 0 to 63.
bool has_bit(const std::string& mask, unsigned bit) {
  std::istringstream stream(mask);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  constexpr unsigned kBits = 8 * sizeof(long);
  if (bit / kBits >= words.size()) return false;
  const std::string& word = words[words.size() - 1 - bit / kBits];
  return ((std::strtoull(word.c_str(), nullptr, 16) >> (bit % kBits)) & 1U) != 0;
}

}  // namespace

std::vector<FoundEvdev> find_force_feedback(const std::string& sysfs, const std::string& nodes) {
  std::vector<FoundEvdev> found;
  std::error_code lack;
  std::filesystem::directory_iterator entries(sysfs, lack), end;
  for (; !lack && entries != end; entries.increment(lack)) {
    const std::string name = entries->path().filename();
    if (name.rfind("event", 0) != 0) continue;
    const auto device = entries->path() / "device";
    if (!has_bit(line_of(device / "capabilities/ff"), FF_CONSTANT)) continue;
    const std::string axes = line_of(device / "capabilities/abs");
    if (!has_bit(axes, ABS_X) && !has_bit(axes, ABS_WHEEL)) continue;
    FoundEvdev is{.path = nodes + "/" + name,
                  .title = line_of(device / "name"),
                  .serial = line_of(device / "uniq"),
                  .trouble = {}};
    if (is.serial.empty()) is.serial = line_of(device / "phys");
    if (access(is.path.c_str(), R_OK | W_OK) != 0)
      is.trouble = is.title + ": " + is.path + " cannot be read and written (" + std::strerror(errno) +
                   "): let a udev rule give it to who sits at this machine, or join the group that owns it";
    found.push_back(std::move(is));
  }
  std::sort(found.begin(), found.end(), [](const FoundEvdev& a, const FoundEvdev& b) { return a.path < b.path; });
  return found;
}

tl::expected<std::unique_ptr<EvdevChannel>, std::string> open_evdev(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return tl::unexpected(path + " does not open: " + std::strerror(errno));
  auto node = std::make_unique<Node>(fd);
  if (const int error = node->set_up(); error != 0)
    return tl::unexpected(path + " is no input device: " + std::strerror(error));
  return node;
}

}  // namespace farfeel::devices
