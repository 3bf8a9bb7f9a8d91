#include "tests/support/devices/emulated_hidraw.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/hidraw.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::test_support {
namespace {

constexpr std::size_t kHidrawQueue = 64;  // reports; the kernel drops the newest beyond
constexpr auto kPump = std::chrono::microseconds(200);

using Pairs = std::vector<std::string>;  // name, value, name, value

std::string add_device(UMockdevTestbed* testbed, const char* subsystem, const std::string& name,
                       const std::string& parent, const Pairs& attributes, const Pairs& properties) {
  const auto list = [](const Pairs& pairs) {
    std::vector<gchar*> pointers;
    for (const std::string& text : pairs) pointers.push_back(const_cast<gchar*>(text.c_str()));
    pointers.push_back(nullptr);
    return pointers;
  };
  auto a = list(attributes), p = list(properties);
  gchar* const path = umockdev_testbed_add_devicev(testbed, subsystem, name.c_str(),
                                                   parent.empty() ? nullptr : parent.c_str(), a.data(), p.data());
  if (path == nullptr) std::abort();
  const std::string made = path;
  g_free(path);
  return made;
}

// The client's memory, as it is when it calls; what is put there reaches the client with its answer.
class ClientMemory {
 public:
  // What a read or write is about.
  explicit ClientMemory(UMockdevIoctlClient* client)
      : data_(static_cast<UMockdevIoctlData*>(g_object_ref(umockdev_ioctl_client_get_arg(client)))) {}
  // What an ioctl's argument points to.
  ClientMemory(UMockdevIoctlClient* client, std::size_t size)
      : data_(umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, size, nullptr)) {
    if (data_ == nullptr) std::abort();
  }
  ~ClientMemory() { g_object_unref(data_); }
  ClientMemory(const ClientMemory&) = delete;
  ClientMemory& operator=(const ClientMemory&) = delete;
  [[nodiscard]] std::span<std::byte> bytes() const {
    return {reinterpret_cast<std::byte*>(data_->data), static_cast<std::size_t>(data_->data_len)};
  }
  void put(std::span<const std::byte> from) {
    std::memcpy(data_->data, from.data(), std::min(from.size(), bytes().size()));
  }

 private:
  UMockdevIoctlData* data_;
};

}  // namespace

MockDevices::MockDevices() : testbed_(umockdev_testbed_new()) {}
MockDevices::~MockDevices() {
  g_object_unref(testbed_);
}

std::string MockDevices::root() const {
  gchar* const path = umockdev_testbed_get_root_dir(testbed_);
  const std::string root = path;
  g_free(path);
  return root;
}

std::string EmulatedHidraw::file() const {
  return mock_.root() + path();
}

EmulatedHidraw::EmulatedHidraw(MockDevices& mock, HidEmulator& device, int number)
    : mock_(mock), device_(device), node_(fmt::format("hidraw{}", number)) {
  UMockdevTestbed* const testbed = mock.testbed();
  const HidIdentity id = device.identity();
  const std::string usb = add_device(
      testbed, "usb", fmt::format("1-{}", number + 1), "",
      {"idVendor", fmt::format("{:04x}", id.vendor), "idProduct", fmt::format("{:04x}", id.product), "product",
       std::string(id.name), "manufacturer", "emulated", "serial", std::string(id.serial), "bcdDevice", "0100"},
      {"DEVTYPE", "usb_device"});
  const std::string interface = add_device(testbed, "usb", fmt::format("1-{}:1.0", number + 1), usb,
                                           {"bInterfaceNumber", "00"}, {"DEVTYPE", "usb_interface"});
  const std::string hid = add_device(
      testbed, "hid", fmt::format("0003:{:04X}:{:04X}.{:04X}", id.vendor, id.product, number + 1), interface, {},
      {"HID_ID", fmt::format("0003:{:08X}:{:08X}", id.vendor, id.product), "HID_NAME", std::string(id.name), "HID_UNIQ",
       std::string(id.serial)});
  const auto descriptor = device.report_descriptor();
  umockdev_testbed_set_attribute_binary(testbed, hid.c_str(), "report_descriptor",
                                        reinterpret_cast<guint8*>(const_cast<std::byte*>(descriptor.data())),
                                        static_cast<gint>(descriptor.size()));
  const std::string hidraw = add_device(testbed, "hidraw", node_, hid, {"dev", fmt::format("244:{}", number)},
                                        {"DEVNAME", path(), "MAJOR", "244", "MINOR", std::to_string(number)});
  umockdev_testbed_set_attribute_link(testbed, hidraw.c_str(), "device", "..");
  sysfs_ = {usb, interface, hid, hidraw};

  ::unlink(file().c_str());
  if (::mkfifo(file().c_str(), 0600) != 0) std::abort();
  fifo_ = ::open(file().c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fifo_ < 0) std::abort();

  answers_ = umockdev_ioctl_base_new();
  g_signal_connect(answers_, "handle-ioctl", G_CALLBACK(on_ioctl), this);
  g_signal_connect(answers_, "handle-read", G_CALLBACK(on_read), this);
  g_signal_connect(answers_, "handle-write", G_CALLBACK(on_write), this);
  GError* error = nullptr;
  if (!umockdev_testbed_attach_ioctl(testbed, path().c_str(), answers_, &error)) std::abort();
  pump_ = std::thread([this] { pump(); });
}

EmulatedHidraw::~EmulatedHidraw() {
  unplug();
  is_ending_ = true;
  pump_.join();
  umockdev_testbed_detach_ioctl(mock_.testbed(), path().c_str(), nullptr);
  g_object_unref(answers_);
  ::close(fifo_);
}

void EmulatedHidraw::unplug() {
  if (is_gone_.exchange(true)) return;
  const std::lock_guard lock(mutex_);
  for (auto device = sysfs_.rbegin(); device != sysfs_.rend(); ++device) {
    umockdev_testbed_uevent(mock_.testbed(), device->c_str(), "remove");
    umockdev_testbed_remove_device(mock_.testbed(), device->c_str());
  }
  // Whoever waits is woken, and reads that the device is gone.
  if (::write(fifo_, "", 1) != 1 && errno != EAGAIN) std::abort();
}

void EmulatedHidraw::pump() {
  std::array<std::byte, 64> report{};
  while (!is_ending_) {
    {
      const std::lock_guard lock(mutex_);
      while (!is_gone_) {
        const std::size_t size = device_.give_input(report, realtime::monotonic_now_ns());
        if (size == 0) break;
        if (waiting_.size() == kHidrawQueue) continue;
        waiting_.emplace_back(report.begin(), report.begin() + static_cast<std::ptrdiff_t>(size));
        if (::write(fifo_, "", 1) != 1) std::abort();
      }
    }
    std::this_thread::sleep_for(kPump);
  }
}

int EmulatedHidraw::on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, void* self_) {
  auto& self = *static_cast<EmulatedHidraw*>(self_);
  const auto request = umockdev_ioctl_client_get_request(client);
  const std::lock_guard lock(self.mutex_);
  long result = -1;
  int error = ENOTTY;
  if (self.is_gone_) {
    error = ENODEV;
  } else if (request == HIDIOCGRDESCSIZE) {
    const int size = static_cast<int>(self.device_.report_descriptor().size());
    ClientMemory(client, sizeof size).put(std::as_bytes(std::span(&size, 1)));
    result = 0;
  } else if (request == HIDIOCGFEATURE(_IOC_SIZE(request))) {
    ClientMemory memory(client, _IOC_SIZE(request));
    std::vector<std::byte> report(memory.bytes().begin(), memory.bytes().end());
    const std::size_t size = self.device_.get_feature(report);
    memory.put(std::span(report).first(size));
    result = size == 0 ? -1 : static_cast<long>(size);
    error = EPIPE;
  } else if (request == HIDIOCSFEATURE(_IOC_SIZE(request))) {
    const ClientMemory memory(client, _IOC_SIZE(request));
    result = self.device_.set_feature(memory.bytes()) ? static_cast<long>(memory.bytes().size()) : -1;
    error = EPIPE;
  }
  umockdev_ioctl_client_complete(client, result, result < 0 ? error : 0);
  return TRUE;
}

int EmulatedHidraw::on_read(UMockdevIoctlBase*, UMockdevIoctlClient* client, void* self_) {
  auto& self = *static_cast<EmulatedHidraw*>(self_);
  const std::lock_guard lock(self.mutex_);
  if (self.is_gone_ || self.waiting_.empty()) {
    umockdev_ioctl_client_complete(client, -1, self.is_gone_ ? EIO : EAGAIN);
    return TRUE;
  }
  const std::vector<std::byte> report = std::move(self.waiting_.front());
  self.waiting_.pop_front();
  char token = 0;
  if (::read(self.fifo_, &token, 1) != 1) std::abort();
  ClientMemory memory(client);
  const std::size_t size = std::min(memory.bytes().size(), report.size());
  memory.put(std::span(report).first(size));
  umockdev_ioctl_client_complete(client, static_cast<glong>(size), 0);
  return TRUE;
}

int EmulatedHidraw::on_write(UMockdevIoctlBase*, UMockdevIoctlClient* client, void* self_) {
  auto& self = *static_cast<EmulatedHidraw*>(self_);
  const std::lock_guard lock(self.mutex_);
  if (self.is_gone_ || self.is_stalled_) {
    umockdev_ioctl_client_complete(client, -1, self.is_gone_ ? ENODEV : EPIPE);
    return TRUE;
  }
  const ClientMemory memory(client);
  self.device_.take_output(memory.bytes(), realtime::monotonic_now_ns());
  umockdev_ioctl_client_complete(client, static_cast<glong>(memory.bytes().size()), 0);
  return TRUE;
}

}  // namespace farfeel::test_support
