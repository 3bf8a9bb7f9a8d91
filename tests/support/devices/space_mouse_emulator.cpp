#include "tests/support/devices/space_mouse_emulator.h"

#include <algorithm>
#include <initializer_list>

namespace farfeel::test_support {
namespace {

constexpr std::int64_t kReportPeriod_ns = 8'000'000;
constexpr int kZerosAfterRelease = 3;

void append(std::vector<std::byte>& to, std::initializer_list<int> bytes) {
  for (const int byte : bytes) to.push_back(static_cast<std::byte>(byte));
}

// HID 1.11, chapter 6.2.2: what each item says stands beside it.
std::vector<std::byte> descriptor_of(SpaceMouseReports reports) {
  const bool is_split = reports == SpaceMouseReports::kSplit;
  std::vector<std::byte> d;
  append(d, {0x05, 0x01,                            // usage page: generic desktop
             0x09, 0x08, 0xA1, 0x01,                // usage: multi-axis controller; application collection
             0xA1, 0x00, 0x85, 0x01,                // physical collection; report 1
             0x16, 0xA2, 0xFE,                      // logical minimum -350
             0x26, 0x5E, 0x01,                      // logical maximum 350
             0x36, 0x88, 0xFA,                      // physical minimum -1400
             0x46, 0x78, 0x05,                      // physical maximum 1400
             0x55, 0x0C, 0x65, 0x11,                // 10^-4 cm
             0x09, 0x30, 0x09, 0x31, 0x09, 0x32});  // x, y, z
  if (is_split) {
    append(d, {0x75, 0x10, 0x95, 0x03, 0x81, 0x06,  // 3 fields of 16 bits; input, relative, as these devices say
               0xC0, 0xA1, 0x00, 0x85, 0x02});      // report 2
  }
  append(d, {0x09, 0x33, 0x09, 0x34, 0x09, 0x35,  // rx, ry, rz
             0x75, 0x10, 0x95, is_split ? 0x03 : 0x06, 0x81, is_split ? 0x06 : 0x02, 0xC0});
  append(d, {0xA1, 0x02, 0x85, 0x03, 0x05, 0x09,  // logical collection; report 3; usage page: buttons
             0x19, 0x01, 0x29, 0x02,              // 1 to 2
             0x15, 0x00, 0x25, 0x01, 0x35, 0x00, 0x45, 0x01, 0x75, 0x01, 0x95, 0x02, 0x81, 0x02,  // 2 bits
             0x95, 0x0E, 0x81, 0x03, 0xC0,                                                        // 14 bits of padding
             0xA1, 0x02, 0x85, 0x04, 0x05, 0x08,  // report 4; usage page: lights
             0x09, 0x4B, 0x15, 0x00, 0x25, 0x01,  // generic indicator
             0x95, 0x01, 0x75, 0x01, 0x91, 0x02,  // 1 bit out
             0x95, 0x01, 0x75, 0x07, 0x91, 0x03, 0xC0, 0xC0});
  return d;
}

}  // namespace

SpaceMouseEmulator::SpaceMouseEmulator(SpaceMouseReports reports)
    : reports_(reports), descriptor_(descriptor_of(reports)) {}

HidIdentity SpaceMouseEmulator::identity() const {
  if (reports_ == SpaceMouseReports::kSplit) return {0x256f, 0xc635, "3Dconnexion SpaceMouse Compact", ""};
  return {0x256f, 0xc62e, "3Dconnexion SpaceMouse Wireless", "36A8"};
}

void SpaceMouseEmulator::deflect(const std::array<std::int16_t, 6>& raw) {
  const bool was_deflected = raw_ != std::array<std::int16_t, 6>{};
  raw_ = raw;
  const int halves = reports_ == SpaceMouseReports::kSplit ? 2 : 1;
  if (was_deflected && raw_ == std::array<std::int16_t, 6>{}) turns_left_ = kZerosAfterRelease * halves;
}

void SpaceMouseEmulator::press(std::uint32_t buttons) {
  buttons_ = buttons & 3;
}

void SpaceMouseEmulator::take_output(std::span<const std::byte> report, std::int64_t /*time_ns*/) {
  if (report.size() == 2 && report[0] == std::byte{4}) {
    is_lit_ = (report[1] & std::byte{1}) != std::byte{0};
  } else {
    ++refused_;
  }
}

SpaceMouseEmulator::Report SpaceMouseEmulator::axes(std::uint8_t id, std::size_t first, std::size_t count) const {
  Report report{std::byte{id}};
  for (std::size_t i = first; i < first + count; ++i) {
    const auto bits = static_cast<std::uint16_t>(raw_[i]);
    append(report, {bits & 0xFF, bits >> 8});
  }
  return report;
}

std::size_t SpaceMouseEmulator::give_input(std::span<std::byte> to, std::int64_t time_ns) {
  Report report;
  if (buttons_ != told_buttons_) {
    told_buttons_ = buttons_;
    append(report, {3, static_cast<int>(buttons_), 0});
  } else {
    const bool is_deflected = raw_ != std::array<std::int16_t, 6>{};
    if ((!is_deflected && turns_left_ == 0) || time_ns < next_ns_) return 0;
    if (!is_deflected) --turns_left_;
    // A device that slept begins anew; one that reports keeps to its period.
    next_ns_ = (time_ns - next_ns_ < kReportPeriod_ns ? next_ns_ : time_ns) + kReportPeriod_ns;
    if (reports_ == SpaceMouseReports::kCombined) {
      report = axes(1, 0, 6);
    } else {
      report = is_second_half_next_ ? axes(2, 3, 3) : axes(1, 0, 3);
      is_second_half_next_ = !is_second_half_next_;
    }
  }
  std::copy(report.begin(), report.end(), to.begin());
  return report.size();
}

}  // namespace farfeel::test_support
