#include "tests/support/devices/emulated_hid_channel.h"

#include <algorithm>
#include <array>

namespace farfeel::test_support {

namespace {
constexpr std::int64_t kLook_ns = 50'000;  // how finely a wait looks for something new
}

bool numbers_reports(std::span<const std::byte> descriptor) {
  for (std::size_t at = 0; at < descriptor.size();) {
    const auto prefix = std::to_integer<unsigned>(descriptor[at]);
    if ((prefix & 0xFC) == 0x84) return true;
    const unsigned size = prefix & 3;
    at += 1 + (size == 3 ? 4 : size);
  }
  return false;
}

void EmulatedHidChannel::gather() {
  std::array<std::byte, 64> bytes{};
  while (const std::size_t size = device_.give_input(bytes, TestClock::time_ns)) {
    std::vector<std::byte> report;
    if (!numbers_reports(device_.report_descriptor())) report.push_back(std::byte{0});
    report.insert(report.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    if (is_silent_) continue;
    switch (input_fault_) {
      case ReportFault::kNone:
        waiting_.push_back(report);
        break;
      case ReportFault::kTruncated:
        report.resize(random_() % report.size());
        waiting_.push_back(report);
        break;
      case ReportFault::kDuplicated:
        waiting_.push_back(report);
        waiting_.push_back(report);
        break;
      case ReportFault::kReordered:  // pairs swap
        if (held_back_.empty()) {
          held_back_ = report;
        } else {
          waiting_.push_back(report);
          waiting_.push_back(std::move(held_back_));
          held_back_.clear();
        }
        break;
      case ReportFault::kMutated:
        for (int i = 0; i < 3; ++i) report[random_() % report.size()] = static_cast<std::byte>(random_());
        waiting_.push_back(report);
        break;
      case ReportFault::kLost:
        break;
    }
  }
}

devices::Transferred EmulatedHidChannel::read(std::span<std::byte> report, std::int64_t deadline_ns) noexcept {
  while (!is_gone_) {
    gather();
    if (!waiting_.empty()) {
      const std::size_t size = std::min(report.size(), waiting_.front().size());
      std::copy_n(waiting_.front().begin(), size, report.begin());
      waiting_.pop_front();
      return {devices::ChannelState::kDone, size};
    }
    if (TestClock::time_ns >= deadline_ns) return {};
    TestClock::time_ns = std::min(deadline_ns, TestClock::time_ns + kLook_ns);
  }
  return {devices::ChannelState::kGone, 0};
}

devices::Transferred EmulatedHidChannel::write(std::span<const std::byte> report) noexcept {
  if (is_gone_ || is_going_) return {devices::ChannelState::kGone, 0};
  if (is_stalled_) return {devices::ChannelState::kStalled, 0};
  written_.emplace_back(report.begin(), report.end());
  device_.take_output(report, TestClock::time_ns);
  return {devices::ChannelState::kDone, report.size()};
}

devices::Transferred EmulatedHidChannel::get_feature(std::span<std::byte> report) noexcept {
  if (is_gone_) return {devices::ChannelState::kGone, 0};
  const std::size_t size = device_.get_feature(report);
  return {size == 0 ? devices::ChannelState::kStalled : devices::ChannelState::kDone, size};
}

devices::Transferred EmulatedHidChannel::set_feature(std::span<const std::byte> report) noexcept {
  if (is_gone_) return {devices::ChannelState::kGone, 0};
  if (!device_.set_feature(report)) return {devices::ChannelState::kStalled, 0};
  return {devices::ChannelState::kDone, report.size()};
}

}  // namespace farfeel::test_support
