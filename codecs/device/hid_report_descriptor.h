// What the reports of a HID device hold, from its report descriptor (USB HID 1.11, chapter 6.2.2).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace farfeel::codecs {

// Bounds: what exceeds them is refused before anything is allocated for it. Those of Linux 6.1, where it has one.
inline constexpr std::size_t kMaxReportDescriptorBytes = 4096;
inline constexpr std::size_t kMaxReportBytes = 16384;
inline constexpr std::size_t kMaxHidFields = 2048;

enum class ReportKind : std::uint8_t { kInput, kOutput, kFeature };

[[nodiscard]] constexpr std::uint32_t hid_usage(std::uint16_t page, std::uint16_t id) noexcept {
  return std::uint32_t{page} << 16 | id;
}

/// One value in a report. Its bits stand in little-endian order; it is signed where logical_min < 0.
struct HidField {
  std::uint32_t usage = 0;        ///< hid_usage(page, id)
  std::uint32_t application = 0;  ///< usage of the outermost collection around it
  std::int32_t logical_min = 0, logical_max = 0;
  std::uint32_t bit_offset = 0;  ///< after the byte of the report's id
  std::uint8_t bits = 0;         ///< 1 to 32
  std::uint8_t report_id = 0;    ///< 0: reports are not numbered
  ReportKind kind = ReportKind::kInput;
};

struct HidReport {
  std::uint8_t id = 0;
  ReportKind kind = ReportKind::kInput;
  std::uint32_t bits = 0;  ///< without the id

  [[nodiscard]] std::size_t bytes() const noexcept { return (bits + 7) / 8; }  ///< without the id
};

struct HidReports {
  std::vector<HidField> fields;  ///< data that stand for one usage each; padding and arrays of usages are left out
  std::vector<HidReport> reports;
  std::vector<std::uint32_t> applications;  ///< usages of the outermost collections
  bool is_numbered = false;                 ///< a report begins with its id

  /// The first with this usage.
  [[nodiscard]] const HidField* field(ReportKind, std::uint32_t usage) const noexcept;
  [[nodiscard]] const HidReport* report(ReportKind, std::uint8_t id) const noexcept;
};

/// For bytes from anybody. Fails on what is too long, or ends inside an item, or contradicts itself: the text says
/// what.
[[nodiscard]] tl::expected<HidReports, std::string> read_report_descriptor(std::span<const std::byte>);

/// The value of a field in a report, whose first byte is its id (0 where reports have none). Nothing where the report
/// is another or too short. Cannot fail otherwise; realtime-safe.
[[nodiscard]] std::optional<std::int64_t> value_in(std::span<const std::byte> report, const HidField&) noexcept;
/// -1 to 1 (0 to 1 where the range has no negative part): the share of the logical range; what lies outside is its end.
[[nodiscard]] double share_of_range(std::int64_t value, const HidField&) noexcept;

}  // namespace farfeel::codecs
