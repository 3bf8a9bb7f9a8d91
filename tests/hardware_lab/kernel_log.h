// When this kernel said that a USB device is gone.
#pragma once

#include <cstdint>
#include <optional>

namespace farfeel::hardware_lab {

/// Reads /dev/kmsg from its end at construction on. Its clock is not CLOCK_MONOTONIC: a line of ours tells how far
/// apart they are.
class KernelLog {
 public:
  KernelLog();
  ~KernelLog();
  KernelLog(const KernelLog&) = delete;
  KernelLog& operator=(const KernelLog&) = delete;

  /// CLOCK_MONOTONIC of the newest "USB disconnect" since the last call, as well as the kernel's log can tell (1 us).
  [[nodiscard]] std::optional<std::int64_t> disconnected_ns();

 private:
  int fd_ = -1;
  std::int64_t offset_ns_ = 0;
};

}  // namespace farfeel::hardware_lab
