#include "codecs/device/space_mouse.h"

#include <algorithm>

namespace farfeel::codecs {
namespace {

constexpr std::uint16_t kGenericDesktop = 0x01, kMultiAxisController = 0x08, kButtonPage = 0x09;
constexpr std::uint16_t kUsageX = 0x30;  // y, z, rx, ry, rz follow
constexpr double kFullDeflection = 350;  // where no descriptor says

struct Product {
  std::uint16_t vendor, product;
  std::string_view title;
};

constexpr std::uint16_t kLogitech = 0x046d, k3Dconnexion = 0x256f;

constexpr Product kProducts[] = {{kLogitech, 0xc603, "SpaceMouse Plus XT"},
                                 {kLogitech, 0xc605, "CADman"},
                                 {kLogitech, 0xc606, "SpaceMouse Classic"},
                                 {kLogitech, 0xc621, "Spaceball 5000"},
                                 {kLogitech, 0xc623, "SpaceTraveler"},
                                 {kLogitech, 0xc625, "SpacePilot"},
                                 {kLogitech, 0xc626, "SpaceNavigator"},
                                 {kLogitech, 0xc627, "SpaceExplorer"},
                                 {kLogitech, 0xc628, "SpaceNavigator for Notebooks"},
                                 {kLogitech, 0xc629, "SpacePilot Pro"},
                                 {kLogitech, 0xc62b, "SpaceMouse Pro"},
                                 {kLogitech, 0xc640, "NuLOOQ"},
                                 {k3Dconnexion, 0xc62e, "SpaceMouse Wireless (cable)"},
                                 {k3Dconnexion, 0xc62f, "SpaceMouse Wireless (receiver)"},
                                 {k3Dconnexion, 0xc631, "SpaceMouse Pro Wireless (cable)"},
                                 {k3Dconnexion, 0xc632, "SpaceMouse Pro Wireless (receiver)"},
                                 {k3Dconnexion, 0xc633, "SpaceMouse Enterprise"},
                                 {k3Dconnexion, 0xc635, "SpaceMouse Compact"},
                                 {k3Dconnexion, 0xc638, "SpaceMouse Pro Wireless BT (cable)"},
                                 {k3Dconnexion, 0xc63a, "SpaceMouse Wireless BT (cable)"},
                                 {k3Dconnexion, 0xc652, "3Dconnexion Universal Receiver"}};

// 3Dconnexion's products from c62e to c63a are pucks, those that the table does not name, too; its mice and keyboards
// are c650 to c658 (but c652), c664, c665 and c668.
constexpr std::uint16_t kFirstPuck = 0xc62e, kLastPuck = 0xc63a;

double int16_at(std::span<const std::byte> report, std::size_t at) noexcept {
  return static_cast<std::int16_t>(std::to_integer<unsigned>(report[at]) | std::to_integer<unsigned>(report[at + 1])
                                                                               << 8);
}

}  // namespace

std::optional<std::string_view> space_mouse_title(std::uint16_t vendor, std::uint16_t product, std::uint16_t usage_page,
                                                  std::uint16_t usage) noexcept {
  if (usage_page != kGenericDesktop || usage != kMultiAxisController) return std::nullopt;
  for (const Product& known : kProducts) {
    if (known.vendor == vendor && known.product == product) return known.title;
  }
  if (vendor == k3Dconnexion && product >= kFirstPuck && product <= kLastPuck) return "SpaceMouse";
  return std::nullopt;
}

SpaceMouseDecoder::SpaceMouseDecoder(std::span<const std::byte> report_descriptor) {
  const auto reports = read_report_descriptor(report_descriptor);
  if (!reports) return;
  is_described_ = true;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const auto usage = hid_usage(kGenericDesktop, static_cast<std::uint16_t>(kUsageX + i));
    const HidField* const field = reports->field(ReportKind::kInput, usage);
    // An axis that cannot be deflected both ways is not one of a cap on springs.
    is_described_ = is_described_ && field != nullptr && field->logical_min < 0 && field->logical_max > 0;
    if (is_described_) axes_[i] = *field;
  }
  for (std::size_t i = 0; is_described_ && i < kMaxButtons; ++i) {
    const auto usage = hid_usage(kButtonPage, static_cast<std::uint16_t>(1 + i));
    const HidField* const field = reports->field(ReportKind::kInput, usage);
    if (field == nullptr) break;
    button_fields_[buttons_++] = *field;
  }
}

bool SpaceMouseDecoder::take(std::span<const std::byte> report) noexcept {
  return is_described_ ? take_described(report) : take_by_length(report);
}

void SpaceMouseDecoder::set_axis(std::size_t axis, double share) noexcept {
  glm::dvec3& to = axis < 3 ? reading_.push : reading_.turn;
  const auto i = static_cast<glm::length_t>(axis % 3);
  to[i] = i == 0 || share == 0 ? share : -share;
}

bool SpaceMouseDecoder::take_described(std::span<const std::byte> report) noexcept {
  // A report that is cut short changes nothing, not even those axes that it still holds.
  std::array<double, 6> shares{};
  std::array<bool, 6> is_there{};
  bool is_of_use = false;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (report.empty() || std::to_integer<std::uint8_t>(report[0]) != axes_[i].report_id) continue;
    const auto value = value_in(report, axes_[i]);
    if (!value) return false;
    shares[i] = share_of_range(*value, axes_[i]);
    is_there[i] = is_of_use = true;
  }
  std::uint32_t buttons = reading_.buttons;
  for (std::size_t i = 0; i < buttons_; ++i) {
    if (report.empty() || std::to_integer<std::uint8_t>(report[0]) != button_fields_[i].report_id) continue;
    const auto value = value_in(report, button_fields_[i]);
    if (!value) return false;
    const std::uint32_t bit = std::uint32_t{1} << i;
    buttons = *value != 0 ? buttons | bit : buttons & ~bit;
    is_of_use = true;
  }
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (is_there[i]) set_axis(i, shares[i]);
  }
  reading_.buttons = buttons;
  return is_of_use;
}

bool SpaceMouseDecoder::take_by_length(std::span<const std::byte> report) noexcept {
  constexpr std::size_t kHalf = 7, kWhole = 13;  // bytes, the id among them
  if (report.empty()) return false;
  const auto id = std::to_integer<unsigned>(report[0]);
  if ((id == 1 || id == 2) && report.size() >= kHalf) {
    const bool is_whole = id == 1 && report.size() >= kWhole;
    const std::size_t first = id == 2 ? 3 : 0, count = is_whole ? 6 : 3;
    for (std::size_t i = 0; i < count; ++i) {
      set_axis(first + i, std::clamp(int16_at(report, 1 + 2 * i) / kFullDeflection, -1.0, 1.0));
    }
    return true;
  }
  if (id == 3 && report.size() >= 2) {
    std::uint32_t buttons = 0;
    for (std::size_t i = 1; i < std::min<std::size_t>(report.size(), 5); ++i) {
      buttons |= std::to_integer<std::uint32_t>(report[i]) << (8 * (i - 1));
    }
    reading_.buttons = buttons;
    return true;
  }
  return false;
}

}  // namespace farfeel::codecs
