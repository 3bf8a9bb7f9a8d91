#include "tests/hardware_lab/hid_gadget.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>

namespace farfeel::hardware_lab {
namespace {

constexpr std::uint8_t kReportId = 0x85;  // item of a report descriptor: reports are numbered
constexpr auto kLook = std::chrono::microseconds(500);

UsbIdentity usb_identity(const test_support::HidIdentity& hid) {
  return {hid.vendor, hid.product, "emulated", std::string(hid.name), std::string(hid.serial)};
}

/// Items are a byte of tag and size, and 0, 1, 2 or 4 of data.
bool numbers_reports(std::span<const std::byte> descriptor) {
  for (std::size_t i = 0; i < descriptor.size();) {
    const auto head = std::to_integer<std::uint8_t>(descriptor[i]);
    if (head == kReportId) return true;
    i += 1 + ((head & 3U) == 3 ? 4 : head & 3U);
  }
  return false;
}

}  // namespace

HidGadget::HidGadget(test_support::HidEmulator& emulator, unsigned report_bytes)
    : emulator_(emulator),
      gadget_("hid", usb_identity(emulator.identity()), "hid.0"),
      report_bytes_(report_bytes),
      numbers_reports_(numbers_reports(emulator.report_descriptor())) {
  const auto descriptor = emulator.report_descriptor();
  write_or_die(gadget_.function_path() + "/report_length", std::to_string(report_bytes));
  write_or_die(gadget_.function_path() + "/report_desc",
               std::string(reinterpret_cast<const char*>(descriptor.data()), descriptor.size()));
  gadget_.add_function();
}

HidGadget::~HidGadget() {
  is_over_ = true;
  if (is_in_) pull_out();
  if (giver_.joinable()) giver_.join();
  if (taker_.joinable()) taker_.join();
  if (fd_ >= 0) close(fd_);
}

void HidGadget::plug_in(bool is_stranger) {
  gadget_.plug_in(is_stranger);
  // The node is made when the gadget is bound, and goes when it is unbound.
  for (int i = 0; i < 1000 && fd_ < 0; ++i) {
    fd_ = open("/dev/hidg0", O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (fd_ < 0) {
    fmt::print(stderr, "no /dev/hidg0: {}\n", std::strerror(errno));
    std::exit(1);
  }
  is_in_ = true;
  giver_ = std::thread([this] { give(); });
  taker_ = std::thread([this] { take(); });
}

std::int64_t HidGadget::pull_out() {
  const std::int64_t before_ns = gadget_.pull_out();
  is_in_ = false;
  giver_.join(), taker_.join();
  close(fd_);
  fd_ = -1;
  return before_ns;
}

void HidGadget::give() {
  std::array<std::byte, 64> report{};
  std::size_t bytes = 0;
  while (is_in_) {
    if (bytes == 0) {
      const std::scoped_lock lock(mutex_);
      bytes = emulator_.give_input(report, now_ns());
    }
    // Refused while the report before still waits for the host: it is given again.
    if (bytes > 0 && write(fd_, report.data(), bytes) == static_cast<ssize_t>(bytes)) bytes = 0;
    std::this_thread::sleep_for(kLook);
  }
}

void HidGadget::take() {
  std::array<std::byte, 65> report{};  // the id first, 0 where reports have none
  const std::size_t first = numbers_reports_ ? 0 : 1;
  while (is_in_) {
    pollfd waits{fd_, POLLIN, 0};
    poll(&waits, 1, 5);
    const ssize_t bytes = read(fd_, report.data() + first, report.size() - first);
    if (bytes <= 0) {
      std::this_thread::sleep_for(kLook);
      continue;
    }
    const std::scoped_lock lock(mutex_);
    emulator_.take_output(std::span(report).first(first + static_cast<std::size_t>(bytes)), now_ns());
  }
}

}  // namespace farfeel::hardware_lab
