#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <thread>

#include "tests/hardware_lab/lab_device.h"
#include "tests/hardware_lab/usb_gadget.h"
#include "tests/support/devices/inverse_service.h"

namespace farfeel::hardware_lab {
namespace {

using devices::InverseService;

// Ids of nobody's: the maker publishes neither the arm's ids nor what it says over USB.
const UsbIdentity kPlug{0x1209, 0x0001, "emulated", "Inverse3", "049D"};
constexpr const char* kNode = "/dev/ttyACM0";
constexpr int kEnumeration_ms = 2000;

constexpr std::array<double, 3> kMiddle_m{0, -0.15, 0.1}, kLow_m{0, -0.15, 0.02};  // of the arm's workspace
constexpr unsigned kButtonA = 1;

/// The arm is a serial device to the kernel, which its maker's service owns; people's programs speak to that service
/// over this machine's network. Here the plug and the network are the kernel's own, the service is imitated: it has an
/// arm from when the serial device is there until the kernel hangs it up.
class LabInverse3 final : public LabDevice {
 public:
  LabInverse3() {
    gadget_.add_function();
    service_.set(InverseService::Fault::kNoArm);
    service_.hold_at(kMiddle_m);
    setenv("FARFEEL_INVERSE3", service_.uri().c_str(), 1);  // for the station, which is started later
  }
  ~LabInverse3() override {
    if (gadget_.is_plugged_in()) pull_out();
  }

  [[nodiscard]] std::string argument() const override { return "inverse3"; }
  [[nodiscard]] std::string node() const override { return {}; }
  [[nodiscard]] bool needs_rule() const override { return false; }
  void plug_in() override {
    gadget_.plug_in();
    int fd = -1;
    for (int i = 0; i < kEnumeration_ms && fd < 0; ++i) {
      fd = open(kNode, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
      if (fd < 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (fd < 0) fmt::print(stderr, "no {}\n", kNode), std::exit(1);
    service_.set(InverseService::Fault::kNone);
    owner_ = std::thread([this, fd] {
      pollfd hung_up{fd, 0, 0};
      while (poll(&hung_up, 1, -1) < 0) {
      }
      service_.set(InverseService::Fault::kNoArm);
      close(fd);
    });
  }
  std::int64_t pull_out() override {
    const std::int64_t before_ns = gadget_.pull_out();
    owner_.join();
    return before_ns;
  }

  void rest() override { service_.hold_at(kMiddle_m); }
  void press_down() override { service_.hold_at(kLow_m); }
  void grip(bool is_held) override { service_.press(is_held ? kButtonA : 0); }
  [[nodiscard]] bool has_force() const override { return true; }
  [[nodiscard]] double force_N() override {
    const auto F = service_.force_N();
    return std::hypot(F[0], F[1], F[2]);
  }
  bool stall() override {
    service_.set(InverseService::Fault::kSilence);
    return true;
  }

 private:
  InverseService service_;
  UsbGadget gadget_{"inverse3", kPlug, "acm.0"};
  std::thread owner_;
};

}  // namespace

std::unique_ptr<LabDevice> make_inverse3() {
  return std::make_unique<LabInverse3>();
}

}  // namespace farfeel::hardware_lab
