// Any bytes as a report descriptor; and those, too, as reports of what it describes.

#include <cmath>
#include <cstdlib>

#include "codecs/device/hid_report_descriptor.h"

using namespace farfeel::codecs;

namespace {

void demand(bool is_so) {
  if (!is_so) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  const auto reports = read_report_descriptor(bytes);
  if (!reports) {
    demand(!reports.error().empty());
    return 0;
  }
  demand(reports->fields.size() <= kMaxHidFields);
  for (const HidField& field : reports->fields) {
    const HidReport* const report = reports->report(field.kind, field.report_id);
    demand(report != nullptr && field.bits >= 1 && field.bits <= 32);
    demand(field.bit_offset + field.bits <= report->bits && report->bytes() <= kMaxReportBytes);
    demand(reports->field(field.kind, field.usage) != nullptr);
    demand((field.report_id != 0) <= reports->is_numbered);
    if (const auto value = value_in(bytes, field)) {
      demand(bytes.size() >= 1 + (field.bit_offset + field.bits + 7) / 8);
      demand(*value >= -(std::int64_t{1} << 31) && *value < std::int64_t{1} << 32);
      demand(std::abs(share_of_range(*value, field)) <= 1);
    }
  }
  return 0;
}
