#include "tests/hardware_lab/kernel_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <string_view>

#include "tests/hardware_lab/usb_gadget.h"

namespace farfeel::hardware_lab {
namespace {

constexpr std::string_view kOurs = "hardware-lab: what time is it";

/// A record is "priority,number,microseconds,flags;text".
std::optional<std::int64_t> time_of(std::string_view record, std::string_view text) {
  if (record.find(text) == std::string_view::npos) return std::nullopt;
  for (int comma = 0; comma < 2; ++comma) record.remove_prefix(record.find(',') + 1);
  std::int64_t us = 0;
  std::from_chars(record.data(), record.data() + record.size(), us);
  return us * 1000;
}

template <typename Take>
void each_record(int fd, const Take& take) {
  std::array<char, 4096> record;
  for (;;) {
    const ssize_t bytes = read(fd, record.data(), record.size());
    if (bytes <= 0) return;
    take(std::string_view(record.data(), static_cast<std::size_t>(bytes)));
  }
}

}  // namespace

KernelLog::KernelLog() : fd_(open("/dev/kmsg", O_RDWR | O_NONBLOCK | O_CLOEXEC)) {
  lseek(fd_, 0, SEEK_END);
  const std::int64_t said_ns = now_ns();
  [[maybe_unused]] const ssize_t said = write(fd_, kOurs.data(), kOurs.size());
  each_record(fd_, [&](std::string_view record) {
    if (const auto heard_ns = time_of(record, kOurs)) offset_ns_ = said_ns - *heard_ns;
  });
}

KernelLog::~KernelLog() {
  if (fd_ >= 0) close(fd_);
}

std::optional<std::int64_t> KernelLog::disconnected_ns() {
  std::optional<std::int64_t> newest;
  each_record(fd_, [&](std::string_view record) {
    if (const auto time_ns = time_of(record, "USB disconnect")) newest = *time_ns + offset_ns_;
  });
  return newest;
}

}  // namespace farfeel::hardware_lab
