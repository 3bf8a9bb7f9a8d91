#include "tests/support/devices/emulated_usbfs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <umockdev.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::test_support {
namespace {

constexpr auto kPump = std::chrono::microseconds(200);
constexpr int kFullSpeed = 2;  // of the kernel's usb_device_speed
constexpr unsigned kSetupBytes = 8;

/// A reference to memory of the client's process: what is put into it reaches the client with an answer.
class Memory {
 public:
  Memory() = default;
  explicit Memory(UMockdevIoctlData* data) : data_(data) {}
  Memory(Memory&& other) noexcept : data_(std::exchange(other.data_, nullptr)) {}
  Memory& operator=(Memory&& other) noexcept {
    std::swap(data_, other.data_);
    return *this;
  }
  ~Memory() {
    if (data_ != nullptr) g_object_unref(data_);
  }
  /// What a pointer in this memory points to.
  [[nodiscard]] Memory at(std::size_t offset, std::size_t size) const {
    return Memory(umockdev_ioctl_data_resolve(data_, offset, size, nullptr));
  }
  template <typename T>
  [[nodiscard]] T& as() const {
    return *reinterpret_cast<T*>(data_->data);
  }
  [[nodiscard]] std::span<std::byte> bytes() const {
    return {reinterpret_cast<std::byte*>(data_->data), static_cast<std::size_t>(data_->data_len)};
  }
  [[nodiscard]] unsigned long address() const { return data_->client_addr; }
  [[nodiscard]] UMockdevIoctlData* get() const { return data_; }

 private:
  UMockdevIoctlData* data_ = nullptr;
};

/// What an ioctl's argument points to.
Memory argument(UMockdevIoctlClient* client, std::size_t size) {
  return Memory(umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, size, nullptr));
}

}  // namespace

struct EmulatedUsbfs::Transfer {
  Memory urb, buffer;
};

EmulatedUsbfs::EmulatedUsbfs(MockDevices& mock, FalconEmulator& device, int address, Node node)
    : mock_(mock), device_(device), address_(address), node_(node) {
  UMockdevTestbed* const testbed = mock.testbed();
  const std::string name = fmt::format("1-{}", address);
  const std::string devnum = std::to_string(address), serial(FalconEmulator::kSerial),
                    product(FalconEmulator::kProductName), devname = path(), minor = std::to_string(address - 1);
  const auto add = [&](const std::string& sysname, const char* parent, std::vector<std::string> attributes,
                       std::vector<std::string> properties) {
    const auto list = [](std::vector<std::string>& pairs) {
      std::vector<gchar*> pointers;
      for (std::string& text : pairs) pointers.push_back(text.data());
      pointers.push_back(nullptr);
      return pointers;
    };
    auto a = list(attributes), p = list(properties);
    gchar* const made = umockdev_testbed_add_devicev(testbed, "usb", sysname.c_str(), parent, a.data(), p.data());
    if (made == nullptr) std::abort();
    const std::string where = made;
    g_free(made);
    return where;
  };
  usb_ = add(name, nullptr,
             {"idVendor", fmt::format("{:04x}", FalconEmulator::kVendor), "idProduct",
              fmt::format("{:04x}", FalconEmulator::kProduct), "busnum", "1", "devnum", devnum, "speed", "12", "serial",
              serial, "product", product, "bConfigurationValue", "1", "dev", "189:" + minor},
             {"DEVTYPE", "usb_device", "DEVNAME", devname, "BUSNUM", "001", "DEVNUM", fmt::format("{:03}", address),
              "MAJOR", "189", "MINOR", minor});
  interface_ = add(name + ":1.0", usb_.c_str(), {"bInterfaceNumber", "00"}, {"DEVTYPE", "usb_interface"});
  std::vector<std::byte> descriptors;
  for (const auto part : {FalconEmulator::device_descriptor(), FalconEmulator::configuration_descriptor()})
    descriptors.insert(descriptors.end(), part.begin(), part.end());
  umockdev_testbed_set_attribute_binary(testbed, usb_.c_str(), "descriptors",
                                        reinterpret_cast<guint8*>(descriptors.data()),
                                        static_cast<gint>(descriptors.size()));
  std::filesystem::create_directories(std::filesystem::path(file()).parent_path());
  ::unlink(file().c_str());
  if (node_ == Node::kFifo) {
    if (::mkfifo(file().c_str(), 0600) != 0) std::abort();
    fifo_ = ::open(file().c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    show_poll();
  } else {
    const int written = ::open(file().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (::write(written, descriptors.data(), descriptors.size()) != static_cast<ssize_t>(descriptors.size()))
      std::abort();
    ::close(written);
  }
  answers_ = umockdev_ioctl_base_new();
  g_signal_connect(answers_, "handle-ioctl", G_CALLBACK(on_ioctl), this);
  if (!umockdev_testbed_attach_ioctl(testbed, path().c_str(), answers_, nullptr)) std::abort();
  pump_ = std::thread([this] { pump(); });
  umockdev_testbed_uevent(testbed, usb_.c_str(), "add");
}

EmulatedUsbfs::~EmulatedUsbfs() {
  unplug();
  is_ending_ = true;
  pump_.join();
  umockdev_testbed_detach_ioctl(mock_.testbed(), path().c_str(), nullptr);
  g_object_unref(answers_);
  if (fifo_ >= 0) ::close(fifo_);
}

std::string EmulatedUsbfs::path() const {
  return fmt::format("/dev/bus/usb/001/{:03}", address_);
}
std::string EmulatedUsbfs::file() const {
  return mock_.root() + path();
}

void EmulatedUsbfs::bind_driver(const std::string& driver) {
  ::unlink((mock_.root() + interface_ + "/driver").c_str());
  umockdev_testbed_set_attribute_link(mock_.testbed(), interface_.c_str(), "driver",
                                      ("../../../bus/usb/drivers/" + driver).c_str());
}

void EmulatedUsbfs::unplug() {
  if (is_gone_.exchange(true)) return;
  const std::lock_guard lock(mutex_);
  while (!under_way_.empty()) complete(under_way_.front(), -ESHUTDOWN, 0);
  for (const std::string* device : {&interface_, &usb_}) {
    umockdev_testbed_uevent(mock_.testbed(), device->c_str(), "remove");
    umockdev_testbed_remove_device(mock_.testbed(), device->c_str());
  }
}

/// usbfs lets poll() say POLLOUT while something can be reaped. A full FIFO cannot be written to; an empty one can.
void EmulatedUsbfs::show_poll() {
  if (fifo_ < 0) return;
  const bool is_full = ended_.empty() && !is_gone_;
  if (is_full == is_fifo_full_) return;
  is_fifo_full_ = is_full;
  std::array<char, 4096> bytes{};
  while (is_full ? ::write(fifo_, bytes.data(), bytes.size()) > 0 : ::read(fifo_, bytes.data(), bytes.size()) > 0) {
  }
}

/// Moves a transfer of under_way_ to ended_.
void EmulatedUsbfs::complete(Transfer& transfer, int status, int bytes) {
  auto& urb = transfer.urb.as<usbdevfs_urb>();
  urb.status = status;
  urb.actual_length = bytes;
  ended_.push_back(std::move(transfer));
  const auto is_moved = [](const Transfer& one) { return one.urb.get() == nullptr; };
  std::erase_if(under_way_, is_moved);
  show_poll();
}

void EmulatedUsbfs::pump() {
  while (!is_ending_) {
    {
      const std::lock_guard lock(mutex_);
      const std::int64_t now_ns = realtime::monotonic_now_ns();
      if (!is_gone_) device_.advance(now_ns);
      while (!is_gone_ && !under_way_.empty()) {  // reads alone wait: all else ends at once
        Transfer& read = under_way_.front();
        const auto in = device_.bulk_in(now_ns, read.buffer.bytes());
        if (!in) break;
        complete(read, in->is_stalled ? -EPIPE : 0, static_cast<int>(in->bytes));
      }
    }
    std::this_thread::sleep_for(kPump);
  }
}

int EmulatedUsbfs::on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, void* self_) {
  auto& self = *static_cast<EmulatedUsbfs*>(self_);
  const std::lock_guard lock(self.mutex_);
  int error = ENOTTY;
  const long result = self.answer(client, umockdev_ioctl_client_get_request(client), error);
  umockdev_ioctl_client_complete(client, result, result < 0 ? error : 0);
  return TRUE;
}

long EmulatedUsbfs::answer(UMockdevIoctlClient* client, unsigned long request, int& error) {
  const bool may_be_gone =
      request == USBDEVFS_REAPURB || request == USBDEVFS_REAPURBNDELAY || request == USBDEVFS_DISCARDURB;
  if (is_gone_ && !may_be_gone) {
    error = ENODEV;
    return -1;
  }
  switch (request) {
    case USBDEVFS_GET_CAPABILITIES:
      argument(client, sizeof(__u32)).as<__u32>() =
          USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
      return 0;
    case USBDEVFS_CONNECTINFO: {
      const Memory memory = argument(client, sizeof(usbdevfs_connectinfo));
      memory.as<usbdevfs_connectinfo>() = {static_cast<unsigned>(address_), 0};
      return 0;
    }
    case USBDEVFS_GET_SPEED:
      return kFullSpeed;
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_DISCONNECT_CLAIM:
      error = EBUSY;
      if (is_claimed_ || is_claimed_elsewhere_) return -1;
      is_claimed_ = true;
      return 0;
    case USBDEVFS_RELEASEINTERFACE:
      is_claimed_ = false;
      return 0;
    case USBDEVFS_GETDRIVER:
    case USBDEVFS_IOCTL:
      error = ENODATA;
      return -1;
    case USBDEVFS_CLEAR_HALT:
      ++halts_cleared_;
      return 0;
    case USBDEVFS_SUBMITURB:
      return submit(client, error);
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      return reap(client, error);
    case USBDEVFS_DISCARDURB:
      return discard(client, error);
    case USBDEVFS_BULK:
      return bulk(client, error);
    default:
      return -1;
  }
}

long EmulatedUsbfs::submit(UMockdevIoctlClient* client, int& error) {
  Transfer transfer{argument(client, sizeof(usbdevfs_urb)), {}};
  const usbdevfs_urb urb = transfer.urb.as<usbdevfs_urb>();
  transfer.buffer = transfer.urb.at(offsetof(usbdevfs_urb, buffer), static_cast<std::size_t>(urb.buffer_length));
  const std::int64_t now_ns = realtime::monotonic_now_ns();
  if (urb.type == USBDEVFS_URB_TYPE_BULK && urb.endpoint == FalconEmulator::kIn) {
    under_way_.push_back(std::move(transfer));
    return 0;
  }
  int status = 0, bytes = urb.buffer_length;
  if (urb.type == USBDEVFS_URB_TYPE_BULK && urb.endpoint == FalconEmulator::kOut) {
    status = device_.bulk_out(now_ns, transfer.buffer.bytes()) ? 0 : -EPIPE;
  } else if (urb.type == USBDEVFS_URB_TYPE_CONTROL && urb.buffer_length >= static_cast<int>(kSetupBytes)) {
    const auto setup = [&](std::size_t i) { return std::to_integer<unsigned>(transfer.buffer.bytes()[i]); };
    const auto word = [&](std::size_t i) { return static_cast<std::uint16_t>(setup(i) | (setup(i + 1) << 8U)); };
    const bool is_taken = device_.control(now_ns, static_cast<std::uint8_t>(setup(0)),
                                          static_cast<std::uint8_t>(setup(1)), word(2), word(4));
    status = is_taken ? 0 : -EPIPE;
    bytes = 0;
  } else {
    error = EINVAL;
    return -1;
  }
  under_way_.push_front(std::move(transfer));
  complete(under_way_.front(), status, status == 0 ? bytes : 0);
  return 0;
}

long EmulatedUsbfs::reap(UMockdevIoctlClient* client, int& error) {
  if (ended_.empty()) {
    error = is_gone_ ? ENODEV : EAGAIN;
    return -1;
  }
  const Memory where = argument(client, sizeof(void*));
  umockdev_ioctl_data_set_ptr(where.get(), 0, ended_.front().urb.get());
  ended_.pop_front();
  show_poll();
  return 0;
}

long EmulatedUsbfs::discard(UMockdevIoctlClient* client, int& error) {
  const unsigned long address = *reinterpret_cast<unsigned long*>(umockdev_ioctl_client_get_arg(client)->data);
  for (Transfer& transfer : under_way_) {
    if (transfer.urb.address() != address) continue;
    complete(transfer, -ENOENT, 0);
    return 0;
  }
  error = EINVAL;
  return -1;
}

/// The keeper's way.
long EmulatedUsbfs::bulk(UMockdevIoctlClient* client, int& error) {
  const Memory memory = argument(client, sizeof(usbdevfs_bulktransfer));
  const auto& asked = memory.as<usbdevfs_bulktransfer>();
  error = EPIPE;
  if (asked.ep != FalconEmulator::kOut) return -1;
  const Memory data = memory.at(offsetof(usbdevfs_bulktransfer, data), asked.len);
  return device_.bulk_out(realtime::monotonic_now_ns(), data.bytes()) ? static_cast<long>(asked.len) : -1;
}

}  // namespace farfeel::test_support
