#include "codecs/device/hid_report_descriptor.h"

#include <algorithm>
#include <array>

namespace farfeel::codecs {
namespace {

constexpr std::size_t kMaxPushed = 8;        // states that Push keeps
constexpr std::size_t kMaxCollections = 32;  // one in another
constexpr std::size_t kMaxUsages = 2048;     // before one main item
constexpr std::size_t kMaxReports = 256;

// An item's prefix: 2 bits of size, 2 of type, 4 of tag. Size and tag are told apart here by the prefix without size.
enum Item : unsigned {
  kInput = 0x80,
  kOutput = 0x90,
  kFeature = 0xB0,
  kCollection = 0xA0,
  kEndCollection = 0xC0,
  kUsagePage = 0x04,
  kLogicalMinimum = 0x14,
  kLogicalMaximum = 0x24,
  kReportSize = 0x74,
  kReportId = 0x84,
  kReportCount = 0x94,
  kPush = 0xA4,
  kPop = 0xB4,
  kUsage = 0x08,
  kUsageMinimum = 0x18,
  kUsageMaximum = 0x28,
  kLongItem = 0xFC
};

constexpr std::uint32_t kIsConstant = 1, kIsVariable = 2;  // of a main item's data

// What stays from item to item until another sets it.
struct Global {
  std::uint16_t usage_page = 0;
  std::int32_t logical_min = 0, logical_max = 0;
  std::uint32_t report_size = 0, report_count = 0;
  std::uint8_t report_id = 0;
  // A maximum is unsigned where the minimum is not negative, which is known only at the main item.
  std::uint32_t raw_logical_max = 0;
};

// A usage with two bytes or less takes its page from the page that holds at the main item; one with four brings its
// own.
struct LocalUsage {
  std::uint32_t value = 0;
  bool has_page = false;

  [[nodiscard]] std::uint32_t with_page(std::uint16_t page) const {
    return has_page ? value : hid_usage(page, static_cast<std::uint16_t>(value));
  }
};

class Parser {
 public:
  explicit Parser(std::span<const std::byte> bytes) : bytes_(bytes) {}

  tl::expected<HidReports, std::string> run() {
    if (bytes_.size() > kMaxReportDescriptorBytes) return fail("is longer than 4096 bytes");
    while (at_ < bytes_.size()) {
      if (const char* trouble = next_item()) return fail(trouble);
    }
    if (depth_ != 0) return fail("ends inside a collection");
    return std::move(found_);
  }

 private:
  tl::expected<HidReports, std::string> fail(const char* trouble) const {
    return tl::unexpected("the report descriptor " + std::string(trouble) + ", at byte " + std::to_string(at_));
  }

  // Nothing, or what is wrong.
  const char* next_item() {
    const auto prefix = std::to_integer<unsigned>(bytes_[at_]);
    if ((prefix & 0xFC) == kLongItem) return skip_long_item();
    const std::size_t size = (prefix & 3) == 3 ? 4 : prefix & 3;
    if (bytes_.size() - at_ - 1 < size) return "ends inside an item";
    std::uint32_t data = 0;
    for (std::size_t i = 0; i < size; ++i) data |= std::to_integer<std::uint32_t>(bytes_[at_ + 1 + i]) << (8 * i);
    at_ += 1 + size;
    return take(prefix & 0xFC, data, size);
  }

  const char* skip_long_item() {
    if (bytes_.size() - at_ < 3) return "ends inside a long item";
    const std::size_t size = 3 + std::to_integer<std::size_t>(bytes_[at_ + 1]);
    if (bytes_.size() - at_ < size) return "ends inside a long item";
    at_ += size;
    return nullptr;
  }

  static std::int32_t as_signed(std::uint32_t data, std::size_t size) {
    if (size == 1) return static_cast<std::int8_t>(data);
    if (size == 2) return static_cast<std::int16_t>(data);
    return static_cast<std::int32_t>(data);
  }

  const char* take(unsigned item, std::uint32_t data, std::size_t size) {
    switch (item) {
      case kUsagePage:
        global_.usage_page = static_cast<std::uint16_t>(data);
        return nullptr;
      case kLogicalMinimum:
        global_.logical_min = as_signed(data, size);
        return nullptr;
      case kLogicalMaximum:
        global_.logical_max = as_signed(data, size);
        global_.raw_logical_max = data;
        return nullptr;
      case kReportSize:
        global_.report_size = data;
        return data > 8 * kMaxReportBytes ? "has a field that is too large" : nullptr;
      case kReportCount:
        global_.report_count = data;
        return data > 8 * kMaxReportBytes ? "has too many fields" : nullptr;
      case kReportId:
        if (data == 0 || data > 255) return "has a report id that is not 1 to 255";
        global_.report_id = static_cast<std::uint8_t>(data);
        found_.is_numbered = true;
        return nullptr;
      case kPush:
        if (pushed_ == kMaxPushed) return "pushes too often";
        stack_[pushed_++] = global_;
        return nullptr;
      case kPop:
        if (pushed_ == 0) return "pops what was not pushed";
        global_ = stack_[--pushed_];
        return nullptr;
      case kUsage:
        return add_usage({data, size == 4});
      case kUsageMinimum:
        minimum_ = {data, size == 4};
        return nullptr;
      case kUsageMaximum:
        return add_usages_up_to(data);
      case kCollection:
        return begin_collection();
      case kEndCollection:
        usages_.clear();
        if (depth_ == 0) return "ends a collection that did not begin";
        --depth_;
        return nullptr;
      case kInput:
        return add_fields(ReportKind::kInput, data);
      case kOutput:
        return add_fields(ReportKind::kOutput, data);
      case kFeature:
        return add_fields(ReportKind::kFeature, data);
      default:  // physical range, unit, designators, strings: nothing that says where a value lies
        return nullptr;
    }
  }

  const char* add_usage(LocalUsage usage) {
    if (usages_.size() == kMaxUsages) return "names too many usages at once";
    usages_.push_back(usage);
    return nullptr;
  }

  const char* add_usages_up_to(std::uint32_t maximum) {
    if (maximum < minimum_.value) return "has a usage maximum below its minimum";
    // Ranges that cover a whole page are usual for arrays; more than fits is of no use to any field.
    const std::uint32_t count = std::min<std::uint32_t>(maximum - minimum_.value + 1, kMaxUsages);
    for (std::uint32_t i = 0; i < count && usages_.size() < kMaxUsages; ++i) {
      usages_.push_back({minimum_.value + i, minimum_.has_page});
    }
    return nullptr;
  }

  const char* begin_collection() {
    if (depth_ == kMaxCollections) return "has too many collections in one another";
    if (depth_++ == 0) {
      application_ = usages_.empty() ? 0 : usages_.front().with_page(global_.usage_page);
      found_.applications.push_back(application_);
    }
    usages_.clear();
    return nullptr;
  }

  HidReport* report(ReportKind kind) {
    for (HidReport& known : found_.reports) {
      if (known.kind == kind && known.id == global_.report_id) return &known;
    }
    if (found_.reports.size() == kMaxReports) return nullptr;
    return &found_.reports.emplace_back(HidReport{global_.report_id, kind, 0});
  }

  const char* add_fields(ReportKind kind, std::uint32_t flags) {
    HidReport* const in = report(kind);
    if (in == nullptr) return "has too many reports";
    const std::uint64_t bits = std::uint64_t{global_.report_size} * global_.report_count;
    if (in->bits + bits > 8 * kMaxReportBytes) return "has a report that is too long";
    const bool is_data = (flags & kIsConstant) == 0 && (flags & kIsVariable) != 0;
    if (is_data && !usages_.empty() && global_.report_size >= 1 && global_.report_size <= 32) {
      if (found_.fields.size() + global_.report_count > kMaxHidFields) return "has too many fields";
      for (std::uint32_t i = 0; i < global_.report_count; ++i) add_field(*in, i);
    }
    in->bits += static_cast<std::uint32_t>(bits);
    usages_.clear();
    return nullptr;
  }

  void add_field(const HidReport& in, std::uint32_t i) {
    HidField field;
    // Where there are more values than usages, the last usage is that of the rest.
    field.usage = usages_[std::min<std::size_t>(i, usages_.size() - 1)].with_page(global_.usage_page);
    field.application = application_;
    field.logical_min = global_.logical_min;
    field.logical_max = global_.logical_max;
    if (global_.logical_min >= 0 && global_.logical_max < global_.logical_min) {
      // 25 FF means 255 where the minimum is 0.
      field.logical_max = static_cast<std::int32_t>(std::min<std::uint32_t>(global_.raw_logical_max, INT32_MAX));
    }
    field.bit_offset = in.bits + i * global_.report_size;
    field.bits = static_cast<std::uint8_t>(global_.report_size);
    field.report_id = in.id;
    field.kind = in.kind;
    found_.fields.push_back(field);
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  HidReports found_;
  Global global_;
  std::array<Global, kMaxPushed> stack_;
  std::size_t pushed_ = 0, depth_ = 0;
  std::vector<LocalUsage> usages_;
  LocalUsage minimum_;
  std::uint32_t application_ = 0;
};

}  // namespace

const HidField* HidReports::field(ReportKind kind, std::uint32_t usage) const noexcept {
  const auto at =
      std::find_if(fields.begin(), fields.end(), [&](const HidField& f) { return f.kind == kind && f.usage == usage; });
  return at == fields.end() ? nullptr : &*at;
}

const HidReport* HidReports::report(ReportKind kind, std::uint8_t id) const noexcept {
  const auto at =
      std::find_if(reports.begin(), reports.end(), [&](const HidReport& r) { return r.kind == kind && r.id == id; });
  return at == reports.end() ? nullptr : &*at;
}

tl::expected<HidReports, std::string> read_report_descriptor(std::span<const std::byte> bytes) {
  return Parser(bytes).run();
}

std::optional<std::int64_t> value_in(std::span<const std::byte> report, const HidField& field) noexcept {
  if (report.empty() || std::to_integer<std::uint8_t>(report[0]) != field.report_id) return std::nullopt;
  const std::size_t first = 1 + field.bit_offset / 8;
  const std::size_t last = 1 + (field.bit_offset + field.bits - 1) / 8;
  if (field.bits == 0 || field.bits > 32 || last >= report.size()) return std::nullopt;
  std::uint64_t around = 0;  // at most 32 bits in 5 bytes
  for (std::size_t i = first; i <= last; ++i) around |= std::to_integer<std::uint64_t>(report[i]) << (8 * (i - first));
  const std::uint64_t mask = (std::uint64_t{1} << field.bits) - 1;
  const auto value = static_cast<std::int64_t>((around >> (field.bit_offset % 8)) & mask);
  const bool is_negative = field.logical_min < 0 && (value >> (field.bits - 1)) != 0;
  return is_negative ? value - (std::int64_t{1} << field.bits) : value;
}

double share_of_range(std::int64_t value, const HidField& field) noexcept {
  // Zero is rest, whatever the range: a range that is not symmetric has a share of its own each way.
  if (value > 0) {
    return field.logical_max <= 0 ? 0 : std::min(1.0, static_cast<double>(value) / field.logical_max);
  }
  if (value < 0) {
    return field.logical_min >= 0 ? 0 : std::max(-1.0, -static_cast<double>(value) / field.logical_min);
  }
  return 0;
}

}  // namespace farfeel::codecs
