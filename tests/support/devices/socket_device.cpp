#include "tests/support/devices/socket_device.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::test_support {
namespace {

using devices::Command;
using devices::DeviceError;
using devices::Driver;
using devices::DriverOptions;
using devices::FoundDevice;
using devices::Sample;
using devices::Stage;
using devices::ZeroForce;

struct Report {
  double x_m;
  std::uint32_t buttons, padding;
};

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  return address;
}

int socket_to(const std::string& path) {
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const sockaddr_un address = address_of(path);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  ::close(fd);
  return -1;
}

class SocketDriver final : public Driver {
 public:
  SocketDriver(FoundDevice found, int fd) : found_(std::move(found)), fd_(fd) {}
  ~SocketDriver() override {
    send(0);
    ::close(fd_);
  }
  const FoundDevice& identity() const noexcept override { return found_; }
  Stage step(std::int64_t /*deadline_ns*/, const Command& command, Sample& newest) override {
    Report report{};
    ssize_t got = 0;
    while ((got = ::recv(fd_, &report, sizeof report, 0)) == sizeof report) {
      newest.time_ns = realtime::monotonic_now_ns();
      newest.X_BD.p.x = report.x_m;
      newest.buttons = report.buttons;
      ++newest.reports;
    }
    if (got == 0) return Stage::kAbsent;
    newest.polled_ns = realtime::monotonic_now_ns();
    if (!send(command.is_force_on ? command.F_hand_B.force_N.x : 0)) return Stage::kAbsent;
    return Stage::kReady;
  }
  std::string advice() const override { return {}; }
  std::optional<ZeroForce> zero_force() const override {
    ZeroForce zero;
    zero.fd = fd_;
    zero.size = sizeof(double);
    return zero;
  }

 private:
  bool send(double force_N) const {
    return ::send(fd_, &force_N, sizeof force_N, MSG_NOSIGNAL) == sizeof force_N || errno == EAGAIN;
  }
  FoundDevice found_;
  int fd_;
};

std::vector<FoundDevice> find(const DriverOptions& options) {
  if (::access(options.firmware.c_str(), F_OK) != 0) return {};
  return {{"socket-device", "1", options.firmware, {}}};
}

tl::expected<std::unique_ptr<Driver>, DeviceError> open(const FoundDevice& found, const DriverOptions& options) {
  const int fd = socket_to(options.firmware);
  if (fd < 0) return tl::unexpected(DeviceError{"nobody listens at " + options.firmware});
  return std::make_unique<SocketDriver>(found, fd);
}

}  // namespace

const devices::DriverFamily kSocketDeviceFamily{"socket-device", find, open};

const devices::DeviceModel* socket_device_model(std::string_view name) {
  static const devices::DeviceModel model = [] {
    devices::DeviceModel made;
    made.name = "socket-device";
    made.title = "A device at a socket";
    made.position_dof = made.force_dof = 1;
    made.mass_kg = 0.1;
    made.viscous_friction_Ns_per_m = 2;
    made.workspace_min_B_m = glm::dvec3(-0.1);
    made.workspace_max_B_m = glm::dvec3(0.1);
    made.max_force_N = made.continuous_force_N = 5;
    made.enabling = devices::Enabling::kHold;
    made.enable_button = 0;
    return made;
  }();
  return name == model.name ? &model : nullptr;
}

SocketDevice::SocketDevice(std::string path) : path_(std::move(path)) {
  listening_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  const sockaddr_un address = address_of(path_);
  ::unlink(path_.c_str());
  if (::bind(listening_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) ::listen(listening_, 1);
}

SocketDevice::~SocketDevice() {
  unplug();
  ::close(listening_);
  ::unlink(path_.c_str());
}

bool SocketDevice::accept(int timeout_ms) {
  unplug();
  pollfd waiting{listening_, POLLIN, 0};
  if (::poll(&waiting, 1, timeout_ms) != 1) return false;
  connected_ = ::accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC);
  return connected_ >= 0;
}

void SocketDevice::tell(double x_m, std::uint32_t buttons) {
  const Report report{x_m, buttons, 0};
  ::send(connected_, &report, sizeof report, MSG_NOSIGNAL | MSG_DONTWAIT);
}

std::optional<SocketDevice::Taken> SocketDevice::take(int timeout_ms) {
  pollfd waiting{connected_, POLLIN, 0};
  Taken taken{};
  if (connected_ < 0 || ::poll(&waiting, 1, timeout_ms) != 1) return std::nullopt;
  if (::recv(connected_, &taken.force_N, sizeof taken.force_N, 0) != sizeof taken.force_N) return std::nullopt;
  taken.time_ns = realtime::monotonic_now_ns();
  return taken;
}

void SocketDevice::unplug() {
  if (connected_ >= 0) ::close(connected_);
  connected_ = -1;
}

}  // namespace farfeel::test_support
