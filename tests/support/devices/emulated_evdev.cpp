#include "tests/support/devices/emulated_evdev.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <span>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::test_support {
namespace {

constexpr std::size_t kQueue = 4096;
constexpr auto kPump = std::chrono::microseconds(500);
constexpr const char* kName = "Emulated force joystick";

/// A bit of a mask that an ioctl asks for.
void set_bit(std::span<std::byte> mask, unsigned bit) {
  if (bit / 8 < mask.size()) mask[bit / 8] |= std::byte{1} << (bit % 8);
}

}  // namespace

EmulatedEvdev::EmulatedEvdev(MockDevices& mock, devices::ForceJoystickEmulator& device, int number)
    : mock_(mock), device_(device), node_(fmt::format("event{}", number)) {
  UMockdevTestbed* const testbed = mock.testbed();
  // The words of the masks are of 64 bits: FF_CONSTANT, FF_GAIN and FF_AUTOCENTER; one axis or two.
  gchar* const input =
      umockdev_testbed_add_device(testbed, "input", fmt::format("input{}", number).c_str(), nullptr, "name", kName,
                                  "uniq", "E1", "phys", "usb-1/input0", "capabilities/ff", "300040000 0",
                                  "capabilities/abs", device.axes() > 1 ? "3" : "1", nullptr, "NAME", kName, nullptr);
  gchar* const event = umockdev_testbed_add_device(testbed, "input", node_.c_str(), input, "dev",
                                                   fmt::format("13:{}", 64 + number).c_str(), nullptr, "DEVNAME",
                                                   path().c_str(), "ID_INPUT_JOYSTICK", "1", nullptr);
  if (input == nullptr || event == nullptr) std::abort();
  umockdev_testbed_set_attribute_link(testbed, event, "device", "..");
  g_free(input);
  g_free(event);

  const std::string file = mock.root() + path();
  std::filesystem::create_directories(std::filesystem::path(file).parent_path());
  ::unlink(file.c_str());
  if (::mkfifo(file.c_str(), 0600) != 0) std::abort();
  fifo_ = ::open(file.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fifo_ < 0) std::abort();
  answers_ = umockdev_ioctl_base_new();
  g_signal_connect(answers_, "handle-ioctl", G_CALLBACK(on_ioctl), this);
  g_signal_connect(answers_, "handle-read", G_CALLBACK(on_read), this);
  g_signal_connect(answers_, "handle-write", G_CALLBACK(on_write), this);
  GError* error = nullptr;
  if (!umockdev_testbed_attach_ioctl(testbed, path().c_str(), answers_, &error)) std::abort();
  pump_ = std::thread([this] { pump(); });
}

EmulatedEvdev::~EmulatedEvdev() {
  unplug();
  is_ending_ = true;
  pump_.join();
  umockdev_testbed_detach_ioctl(mock_.testbed(), path().c_str(), nullptr);
  g_object_unref(answers_);
  ::close(fifo_);
}

void EmulatedEvdev::unplug() {
  if (is_gone_.exchange(true)) return;
  if (::write(fifo_, "", 1) != 1 && errno != EAGAIN) std::abort();  // whoever waits is woken
}

void EmulatedEvdev::overflow() {
  const std::lock_guard lock(mutex_);
  device_.advance_to(realtime::monotonic_now_ns());
  while (device_.event()) {
  }
  input_event event{};
  event.type = EV_SYN, event.code = SYN_DROPPED;
  queue(event);
  event.code = SYN_REPORT;
  queue(event);
}

void EmulatedEvdev::queue(const input_event& event) {
  if (waiting_.size() == kQueue) return;
  waiting_.push_back(event);
  if (::write(fifo_, "", 1) != 1) std::abort();
}

void EmulatedEvdev::pump() {
  while (!is_ending_) {
    {
      const std::lock_guard lock(mutex_);
      device_.advance_to(realtime::monotonic_now_ns());
      while (const auto event = device_.event())
        if (!is_gone_) queue(*event);
    }
    std::this_thread::sleep_for(kPump);
  }
}

/// The ioctl's result, below 0: an errno; at mutex_.
long EmulatedEvdev::answer(unsigned long request, std::span<std::byte> memory) {
  const auto give = [&](const void* from, std::size_t size) {
    std::memcpy(memory.data(), from, std::min(size, memory.size()));
    return static_cast<long>(std::min(size, memory.size()));
  };
  const unsigned number = _IOC_NR(request);
  if (request == EVIOCSCLOCKID) return 0;
  if (request == EVIOCSFF) {
    ff_effect effect;
    std::memcpy(&effect, memory.data(), sizeof effect);
    const int error = device_.upload(effect);
    give(&effect, sizeof effect);
    return -error;
  }
  if (_IOC_DIR(request) != _IOC_READ || _IOC_TYPE(request) != 'E') return -EINVAL;
  if (request == EVIOCGVERSION) {
    const int version = 0x010001;
    give(&version, sizeof version);
    return 0;
  }
  if (request == EVIOCGID) {
    const input_id id{.bustype = BUS_USB, .vendor = 0x1209, .product = 0xffb0, .version = 1};
    give(&id, sizeof id);
    return 0;
  }
  if (number == _IOC_NR(EVIOCGNAME(0))) return give(kName, std::strlen(kName) + 1);
  if (number >= _IOC_NR(EVIOCGABS(0)) && number <= _IOC_NR(EVIOCGABS(ABS_MAX))) {
    const int axis = static_cast<int>(number - _IOC_NR(EVIOCGABS(0)));
    if (axis >= device_.axes()) return -EINVAL;
    const input_absinfo info = device_.axis(axis);
    give(&info, sizeof info);
    return 0;
  }
  std::fill(memory.begin(), memory.end(), std::byte{0});
  if (number == _IOC_NR(EVIOCGBIT(0, 0))) {
    for (const unsigned type : {EV_SYN, EV_KEY, EV_ABS, EV_FF}) set_bit(memory, type);
  } else if (number == _IOC_NR(EVIOCGBIT(EV_ABS, 0))) {
    for (int i = 0; i < device_.axes(); ++i) set_bit(memory, static_cast<unsigned>(ABS_X + i));
  } else if (number == _IOC_NR(EVIOCGBIT(EV_KEY, 0))) {
    for (unsigned i = 0; i < 12; ++i) set_bit(memory, BTN_JOYSTICK + i);
  } else if (number == _IOC_NR(EVIOCGBIT(EV_FF, 0))) {
    for (const unsigned bit : {FF_CONSTANT, FF_GAIN, FF_AUTOCENTER}) set_bit(memory, bit);
  } else if (number == _IOC_NR(EVIOCGPHYS(0)) || number == _IOC_NR(EVIOCGUNIQ(0))) {
    return -ENOENT;
  }
  return static_cast<long>(memory.size());
}

int EmulatedEvdev::on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, void* self_) {
  auto& self = *static_cast<EmulatedEvdev*>(self_);
  const auto request = umockdev_ioctl_client_get_request(client);
  const std::lock_guard lock(self.mutex_);
  long result = -ENODEV;
  if (!self.is_gone_) {
    UMockdevIoctlData* const data =
        umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, _IOC_SIZE(request), nullptr);
    if (data == nullptr) std::abort();
    result = self.answer(request, {reinterpret_cast<std::byte*>(data->data), static_cast<std::size_t>(data->data_len)});
    g_object_unref(data);
  }
  umockdev_ioctl_client_complete(client, result < 0 ? -1 : result, result < 0 ? static_cast<gint>(-result) : 0);
  return TRUE;
}

int EmulatedEvdev::on_read(UMockdevIoctlBase*, UMockdevIoctlClient* client, void* self_) {
  auto& self = *static_cast<EmulatedEvdev*>(self_);
  const std::lock_guard lock(self.mutex_);
  if (self.is_gone_ || self.waiting_.empty()) {
    umockdev_ioctl_client_complete(client, -1, self.is_gone_ ? ENODEV : EAGAIN);
    return TRUE;
  }
  auto* const data = static_cast<UMockdevIoctlData*>(g_object_ref(umockdev_ioctl_client_get_arg(client)));
  std::size_t size = 0;
  while (!self.waiting_.empty() && size + sizeof(input_event) <= static_cast<std::size_t>(data->data_len)) {
    std::memcpy(data->data + size, &self.waiting_.front(), sizeof(input_event));
    self.waiting_.pop_front();
    char token = 0;
    if (::read(self.fifo_, &token, 1) != 1) std::abort();
    size += sizeof(input_event);
  }
  umockdev_ioctl_client_complete(client, static_cast<glong>(size), 0);
  g_object_unref(data);
  return TRUE;
}

int EmulatedEvdev::on_write(UMockdevIoctlBase*, UMockdevIoctlClient* client, void* self_) {
  auto& self = *static_cast<EmulatedEvdev*>(self_);
  const std::lock_guard lock(self.mutex_);
  if (self.is_gone_) {
    umockdev_ioctl_client_complete(client, -1, ENODEV);
    return TRUE;
  }
  auto* const data = static_cast<UMockdevIoctlData*>(g_object_ref(umockdev_ioctl_client_get_arg(client)));
  self.device_.advance_to(realtime::monotonic_now_ns());
  for (gsize at = 0; at + sizeof(input_event) <= static_cast<gsize>(data->data_len); at += sizeof(input_event)) {
    input_event event;
    std::memcpy(&event, data->data + at, sizeof event);
    self.device_.write(event.type, event.code, event.value);
  }
  umockdev_ioctl_client_complete(client, static_cast<glong>(data->data_len), 0);
  g_object_unref(data);
  return TRUE;
}

}  // namespace farfeel::test_support
