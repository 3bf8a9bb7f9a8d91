#include <fcntl.h>
#include <fmt/format.h>
#include <linux/uinput.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <thread>

#include "tests/hardware_lab/lab_device.h"
#include "tests/hardware_lab/usb_gadget.h"
#include "tests/support/devices/force_joystick_emulator.h"

namespace farfeel::hardware_lab {
namespace {

constexpr int kAxes = 2;
constexpr std::array<std::uint16_t, 4> kKeys{BTN_TRIGGER, BTN_THUMB, BTN_THUMB2, BTN_TOP};
constexpr double kPush_N = 3;  // the hand's, towards the person

[[noreturn]] void die(const char* what) {
  fmt::print(stderr, "{}: {}\n", what, std::strerror(errno));
  std::exit(1);
}

void ask(int fd, unsigned long request, int value) {
  if (ioctl(fd, request, value) < 0) die("uinput refuses a property of the joystick");
}

/// Through uinput: the kernel's input layer and its evdev node are real, the USB below is not there.
class LabJoystick final : public LabDevice {
 public:
  ~LabJoystick() override {
    if (fd_ >= 0) pull_out();
  }

  [[nodiscard]] std::string argument() const override { return "pid-joystick"; }
  [[nodiscard]] std::string node() const override { return node_; }

  void plug_in() override {
    fd_ = open("/dev/uinput", O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0) die("cannot open /dev/uinput");
    for (const int type : {EV_KEY, EV_ABS, EV_FF}) ask(fd_, UI_SET_EVBIT, type);
    for (const int key : kKeys) ask(fd_, UI_SET_KEYBIT, key);
    for (const int effect : {FF_CONSTANT, FF_GAIN, FF_AUTOCENTER}) ask(fd_, UI_SET_FFBIT, effect);
    for (int i = 0; i < kAxes; ++i) {
      uinput_abs_setup axis{};
      axis.code = static_cast<std::uint16_t>(ABS_X + i);
      axis.absinfo = emulator_.axis(i);
      if (ioctl(fd_, UI_ABS_SETUP, &axis) < 0) die("uinput refuses an axis");
    }
    uinput_setup setup{};
    setup.id = {.bustype = BUS_USB, .vendor = 0x1209, .product = 0xffb0, .version = 1};
    std::strcpy(setup.name, "emulated force joystick");
    setup.ff_effects_max = devices::ForceJoystickEmulator::kEffects;
    if (ioctl(fd_, UI_DEV_SETUP, &setup) < 0 || ioctl(fd_, UI_DEV_CREATE) < 0) die("uinput makes no joystick");
    is_in_ = true;
    serve_ = std::thread([this] { serve(); });
    std::array<char, 64> name{};
    ioctl(fd_, UI_GET_SYSNAME(name.size()), name.data());
    std::error_code error;
    for (const auto& entry :
         std::filesystem::directory_iterator(fmt::format("/sys/devices/virtual/input/{}", name.data()), error)) {
      const std::string event = entry.path().filename();
      if (event.starts_with("event")) node_ = "/dev/input/" + event;
    }
  }

  std::int64_t pull_out() override {
    const std::int64_t before_ns = now_ns();
    ioctl(fd_, UI_DEV_DESTROY);
    is_in_ = false;
    serve_.join();
    close(fd_);
    fd_ = -1;
    node_.clear();
    return before_ns;
  }

  void rest() override { push(0); }
  void press_down() override { push(kPush_N); }
  void grip(bool is_held) override {
    const std::scoped_lock lock(mutex_);
    emulator_.press(kKeys[0], is_held);
  }
  [[nodiscard]] bool has_force() const override { return true; }
  [[nodiscard]] double force_N() override {
    const std::scoped_lock lock(mutex_);
    emulator_.advance_to(now_ns());
    const auto force = emulator_.effect_force_N();
    return std::hypot(force[0], force[1]);
  }

 private:
  void push(double towards_N) {
    const std::scoped_lock lock(mutex_);
    emulator_.push(0, towards_N);
  }

  void serve() {
    while (is_in_) {
      pollfd waits{fd_, POLLIN, 0};
      poll(&waits, 1, 1);
      input_event asked{};
      while (is_in_ && read(fd_, &asked, sizeof asked) == static_cast<ssize_t>(sizeof asked)) obey(asked);
      const std::scoped_lock lock(mutex_);
      emulator_.advance_to(now_ns());
      while (const auto event = emulator_.event()) {
        [[maybe_unused]] const ssize_t told = write(fd_, &*event, sizeof *event);
      }
    }
  }

  void obey(const input_event& asked) {
    const std::scoped_lock lock(mutex_);
    if (asked.type == EV_UINPUT && asked.code == UI_FF_UPLOAD) {
      uinput_ff_upload upload{};
      upload.request_id = static_cast<std::uint32_t>(asked.value);
      if (ioctl(fd_, UI_BEGIN_FF_UPLOAD, &upload) < 0) return;
      // The kernel has given it an id; the emulator has the same slots.
      ff_effect effect = upload.effect;
      if (!is_known_[static_cast<std::size_t>(effect.id)]) effect.id = -1;
      upload.retval = -emulator_.upload(effect);
      if (upload.retval == 0) {
        is_known_[static_cast<std::size_t>(upload.effect.id)] = true;
        ids_[static_cast<std::size_t>(upload.effect.id)] = effect.id;
      }
      ioctl(fd_, UI_END_FF_UPLOAD, &upload);
    } else if (asked.type == EV_UINPUT && asked.code == UI_FF_ERASE) {
      uinput_ff_erase erase{};
      erase.request_id = static_cast<std::uint32_t>(asked.value);
      if (ioctl(fd_, UI_BEGIN_FF_ERASE, &erase) < 0) return;
      erase.retval = -emulator_.erase(ids_[erase.effect_id]);
      is_known_[erase.effect_id] = false;
      ioctl(fd_, UI_END_FF_ERASE, &erase);
    } else if (asked.type == EV_FF) {
      emulator_.write(EV_FF, asked.code, asked.value);
    }
  }

  static constexpr std::size_t kSlots = devices::ForceJoystickEmulator::kEffects;
  devices::ForceJoystickEmulator emulator_{kAxes};
  std::array<bool, kSlots> is_known_{};
  std::array<int, kSlots> ids_{};  // the kernel's slot -> the emulator's
  std::mutex mutex_;
  std::atomic<bool> is_in_{false};
  std::string node_;
  int fd_ = -1;
  std::thread serve_;
};

}  // namespace

std::unique_ptr<LabDevice> make_joystick() {
  return std::make_unique<LabJoystick>();
}

}  // namespace farfeel::hardware_lab
