// An emulated HID device in memory, behind the interface that drivers use, on a clock that the test moves; and what can
// go wrong on the way.
#pragma once

#include <cstdint>
#include <deque>
#include <random>
#include <vector>

#include "master_station/devices/channel/channel.h"
#include "tests/support/devices/hid_emulator.h"

namespace farfeel::test_support {

/// The time of a test, for drivers that ask for it by a function. Waiting for a device moves it.
struct TestClock {
  static inline std::int64_t time_ns = 1'000'000'000;
  static std::int64_t now() noexcept { return time_ns; }
};

enum class ReportFault : std::uint8_t { kNone, kTruncated, kDuplicated, kReordered, kMutated, kLost };

class EmulatedHidChannel final : public devices::HidChannel {
 public:
  explicit EmulatedHidChannel(HidEmulator& device) : device_(device) {}

  /// What happens to every report of the device from now on.
  void spoil_input(ReportFault fault) { input_fault_ = fault; }
  void stall_output(bool is_stalled) { is_stalled_ = is_stalled; }
  void unplug() { is_gone_ = true; }
  /// The plug is pulled, and the kernel has not told readers yet: they hear nothing more, writers are refused.
  void begin_to_unplug() { is_silent_ = is_going_ = true; }
  void stop_answering(bool is_silent) { is_silent_ = is_silent; }
  /// What the device sends by now waits for a read from here on; a read does so, too.
  void gather();
  [[nodiscard]] const std::vector<std::vector<std::byte>>& written() const { return written_; }
  void forget_written() { written_.clear(); }

  devices::Transferred read(std::span<std::byte> report, std::int64_t deadline_ns) noexcept override;
  devices::Transferred write(std::span<const std::byte> report) noexcept override;
  devices::Transferred get_feature(std::span<std::byte> report) noexcept override;
  devices::Transferred set_feature(std::span<const std::byte> report) noexcept override;
  [[nodiscard]] std::span<const std::byte> report_descriptor() const noexcept override {
    return device_.report_descriptor();
  }
  [[nodiscard]] int descriptor() const noexcept override { return -1; }

 private:
  HidEmulator& device_;
  ReportFault input_fault_ = ReportFault::kNone;
  bool is_stalled_ = false, is_gone_ = false, is_going_ = false, is_silent_ = false;
  std::deque<std::vector<std::byte>> waiting_;
  std::vector<std::byte> held_back_;  // of kReordered
  std::vector<std::vector<std::byte>> written_;
  std::mt19937 random_{1};
};

/// Whether a report descriptor numbers its reports: it has an item Report ID.
[[nodiscard]] bool numbers_reports(std::span<const std::byte> report_descriptor);

}  // namespace farfeel::test_support
