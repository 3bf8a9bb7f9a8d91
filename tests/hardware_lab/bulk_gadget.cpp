#include "tests/hardware_lab/bulk_gadget.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usb/functionfs.h>
#include <poll.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>

namespace farfeel::hardware_lab {
namespace {

constexpr const char* kMount = "/tmp/ffs";
constexpr std::uint16_t kBulkPacket_FS = 64;  // dummy_hcd is told to run at full speed, as the device does
constexpr auto kLook = std::chrono::microseconds(500);
// A packet of modem status alone waits so long for company: the emulated bus moves one packet a frame of 4 ms, and one
// that says nothing would hold the next answer up for a frame. Status alone is two bytes.
constexpr std::int64_t kStatusAlone_ns = 16'000'000;
constexpr std::size_t kStatusBytes = 2;

// What FunctionFS reads from its control file: descriptors, then strings. Little-endian, as this machine is.
#pragma pack(push, 1)
struct Interface {
  usb_interface_descriptor interface;
  usb_endpoint_descriptor_no_audio in, out;
};
struct Descriptors {
  usb_functionfs_descs_head_v2 head;
  std::uint32_t full_speed_count, high_speed_count;
  Interface full_speed, high_speed;
};
struct Strings {
  usb_functionfs_strings_head head;
  std::uint16_t language;
  std::array<char, 7> name;
};
#pragma pack(pop)

Interface vendor_interface(std::uint16_t packet) {
  Interface made{};
  made.interface.bLength = sizeof made.interface;
  made.interface.bDescriptorType = USB_DT_INTERFACE;
  made.interface.bNumEndpoints = 2;
  made.interface.bInterfaceClass = USB_CLASS_VENDOR_SPEC;
  made.interface.bInterfaceSubClass = made.interface.bInterfaceProtocol = 0xff;
  made.interface.iInterface = 1;
  const auto bulk = [packet](usb_endpoint_descriptor_no_audio& endpoint, std::uint8_t address) {
    endpoint.bLength = sizeof endpoint;
    endpoint.bDescriptorType = USB_DT_ENDPOINT;
    endpoint.bEndpointAddress = address;
    endpoint.bmAttributes = USB_ENDPOINT_XFER_BULK;
    endpoint.wMaxPacketSize = packet;
  };
  bulk(made.in, test_support::FalconEmulator::kIn);
  bulk(made.out, test_support::FalconEmulator::kOut);
  return made;
}

[[noreturn]] void die(const std::string& what) {
  fmt::print(stderr, "{}: {}\n", what, std::strerror(errno));
  std::exit(1);
}

template <typename T>
void put(int fd, const T& value) {
  if (write(fd, &value, sizeof value) != static_cast<ssize_t>(sizeof value)) die("FunctionFS refused what it was told");
}

}  // namespace

BulkGadget::BulkGadget(test_support::FalconEmulator& emulator, const UsbIdentity& identity)
    : emulator_(emulator), gadget_("bulk", identity, "ffs.bulk") {
  mkdir(kMount, 0700);
  if (mount("bulk", kMount, "functionfs", 0, nullptr) != 0) die("cannot mount functionfs");
  control_fd_ = open("/tmp/ffs/ep0", O_RDWR | O_CLOEXEC);
  if (control_fd_ < 0) die("cannot open ep0");

  Descriptors descriptors{};
  descriptors.head.magic = FUNCTIONFS_DESCRIPTORS_MAGIC_V2;
  descriptors.head.length = sizeof descriptors;
  // A vendor's requests go to the device, not to an interface: FunctionFS hands on those, too, when asked.
  descriptors.head.flags = FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | FUNCTIONFS_ALL_CTRL_RECIP;
  descriptors.full_speed_count = descriptors.high_speed_count = 3;
  descriptors.full_speed = vendor_interface(kBulkPacket_FS);
  descriptors.high_speed = vendor_interface(512);  // never used, but a high-speed host controller asks for it
  put(control_fd_, descriptors);
  Strings strings{};
  strings.head.magic = FUNCTIONFS_STRINGS_MAGIC;
  strings.head.length = sizeof strings;
  strings.head.str_count = strings.head.lang_count = 1;
  strings.language = 0x409;
  std::memcpy(strings.name.data(), "FALCON", 7);
  put(control_fd_, strings);

  in_fd_ = open("/tmp/ffs/ep1", O_RDWR | O_CLOEXEC);
  out_fd_ = open("/tmp/ffs/ep2", O_RDWR | O_CLOEXEC);
  if (in_fd_ < 0 || out_fd_ < 0) die("cannot open the bulk endpoints");
  gadget_.add_function();
  controller_ = std::thread([this] { answer_control(); });
}

BulkGadget::~BulkGadget() {
  if (is_in_) pull_out();
  is_over_ = true;
  controller_.join();
  for (const int fd : {in_fd_, out_fd_, control_fd_}) close(fd);
  umount(kMount);
}

void BulkGadget::plug_in(bool is_stranger) {
  is_stalled_ = false;
  is_in_ = true;
  gadget_.plug_in(is_stranger);
  giver_ = std::thread([this] { give(); });
  taker_ = std::thread([this] { take(); });
}

std::int64_t BulkGadget::pull_out() {
  const std::int64_t before_ns = gadget_.pull_out();
  is_in_ = false;
  giver_.join(), taker_.join();
  return before_ns;
}

void BulkGadget::stall() {
  is_stalled_ = true;
}

void BulkGadget::answer_control() {
  while (!is_over_) {
    pollfd waits{control_fd_, POLLIN, 0};
    if (poll(&waits, 1, 20) <= 0) continue;
    usb_functionfs_event event{};
    if (read(control_fd_, &event, sizeof event) != static_cast<ssize_t>(sizeof event)) continue;
    if (event.type != FUNCTIONFS_SETUP) continue;
    const usb_ctrlrequest& setup = event.u.setup;
    std::array<std::byte, 256> data{};
    const std::size_t bytes = std::min<std::size_t>(setup.wLength, data.size());
    const bool is_in = (setup.bRequestType & USB_DIR_IN) != 0;
    bool is_taken = false;
    {
      const std::scoped_lock lock(mutex_);
      is_taken =
          !is_stalled_ && emulator_.control(now_ns(), setup.bRequestType, setup.bRequest, setup.wValue, setup.wIndex);
    }
    // The wrong direction is FunctionFS's way to stall.
    const bool does_write = is_in == is_taken;
    [[maybe_unused]] const ssize_t done =
        does_write ? write(control_fd_, data.data(), is_taken ? bytes : 0) : read(control_fd_, data.data(), bytes);
  }
}

void BulkGadget::give() {
  std::array<std::byte, 512> bytes{};
  std::int64_t given_ns = 0;
  while (is_in_) {
    std::optional<test_support::FalconEmulator::In> in;
    if (is_stalled_) {
      in = test_support::FalconEmulator::In{.is_stalled = true};
    } else {
      const std::scoped_lock lock(mutex_);
      emulator_.advance(now_ns());
      in = emulator_.bulk_in(now_ns(), bytes);
    }
    if (!in) {
      std::this_thread::sleep_for(kLook);
    } else if (in->is_stalled) {
      [[maybe_unused]] const ssize_t stalled = read(in_fd_, bytes.data(), bytes.size());
      std::this_thread::sleep_for(kLook);
    } else if (in->bytes == kStatusBytes && now_ns() - given_ns < kStatusAlone_ns) {
      std::this_thread::sleep_for(kLook);
    } else if (given_ns = now_ns(); write(in_fd_, bytes.data(), in->bytes) < 0) {
      std::this_thread::sleep_for(kLook);  // pulled out meanwhile, or not yet configured
    }
  }
}

void BulkGadget::take() {
  std::array<std::byte, 512> bytes{};
  while (is_in_) {
    if (is_stalled_) {
      [[maybe_unused]] const ssize_t stalled = write(out_fd_, bytes.data(), 1);
      std::this_thread::sleep_for(kLook);
      continue;
    }
    const ssize_t came = read(out_fd_, bytes.data(), bytes.size());
    if (came <= 0) {
      std::this_thread::sleep_for(kLook);
      continue;
    }
    const std::scoped_lock lock(mutex_);
    emulator_.bulk_out(now_ns(), std::span(bytes).first(static_cast<std::size_t>(came)));
  }
}

}  // namespace farfeel::hardware_lab
