// Reports of 3Dconnexion's SpaceMouse family, as how far the cap is deflected.
//
// Two layouts are about. Split: report 1 holds x, y, z and report 2 holds rx, ry, rz. Combined: report 1 holds all six.
// A model's name does not tell which, so the report descriptor decides; where it does not name the axes, a report's
// length does. Raw axes are x to the right, y towards the person and z down. Base frame B is x to the right, y away
// from the person and z up, so raw to B is half a turn about x: (x, -y, -z), for pushes and turns alike.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string_view>

#include "codecs/device/hid_report_descriptor.h"

namespace farfeel::codecs {

/// What this device is called, by its ids and by the usage of its HID interface; nothing where it is no SpaceMouse: the
/// maker's mice and keyboards, another interface of the same device, another maker. Its product string is never looked
/// at: it is empty where the caller lacks permission.
[[nodiscard]] std::optional<std::string_view> space_mouse_title(std::uint16_t vendor, std::uint16_t product,
                                                                std::uint16_t usage_page, std::uint16_t usage) noexcept;

/// Shares of full deflection, -1 to 1, in B.
struct SpaceMouseReading {
  glm::dvec3 turn{0, 0, 0};
  glm::dvec3 push{0, 0, 0};
  std::uint32_t buttons = 0;  ///< bit i: button i is down

  friend bool operator==(const SpaceMouseReading&, const SpaceMouseReading&) = default;
};

class SpaceMouseDecoder {
 public:
  /// Any bytes, or none.
  explicit SpaceMouseDecoder(std::span<const std::byte> report_descriptor);

  /// One input report, its id first. False: it is of another kind or too short, and nothing changed. Realtime-safe.
  bool take(std::span<const std::byte> report) noexcept;
  [[nodiscard]] const SpaceMouseReading& reading() const noexcept { return reading_; }
  [[nodiscard]] bool is_described() const noexcept { return is_described_; }  ///< false: lengths decide

 private:
  static constexpr std::size_t kMaxButtons = 32;

  bool take_described(std::span<const std::byte> report) noexcept;
  bool take_by_length(std::span<const std::byte> report) noexcept;
  void set_axis(std::size_t axis, double share) noexcept;

  bool is_described_ = false;
  std::array<HidField, 6> axes_;  // x, y, z, rx, ry, rz
  std::array<HidField, kMaxButtons> button_fields_;
  std::size_t buttons_ = 0;
  SpaceMouseReading reading_;
};

/// The output report that lights the ring, or darkens it.
[[nodiscard]] constexpr std::array<std::byte, 2> space_mouse_light(bool is_on) noexcept {
  return {std::byte{4}, std::byte{is_on}};
}

}  // namespace farfeel::codecs
