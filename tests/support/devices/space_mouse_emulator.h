// A 3Dconnexion SpaceMouse: a cap on springs that tells how far it is deflected. Written from public descriptions of
// its reports, not from the driver.
//
//   split     report 1: x, y, z    report 2: rx, ry, rz    each int16, little-endian; the ids take turns every 8 ms
//   combined  report 1: x, y, z, rx, ry, rz
//   both      report 3: buttons, a bit each; output report 4: one byte, 1 lights the ring
//
// Raw axes: x to the right, y towards the person, z down. +-350 is full deflection. While the cap is deflected reports
// come every 8 ms; once it is let go, zeros come three times, and then nothing.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tests/support/devices/hid_emulator.h"

namespace farfeel::test_support {

enum class SpaceMouseReports : std::uint8_t { kSplit, kCombined };

class SpaceMouseEmulator final : public HidEmulator {
 public:
  explicit SpaceMouseEmulator(SpaceMouseReports);  ///< a SpaceMouse Compact, or a SpaceMouse Wireless on its cable

  /// The hand's doing. raw: x, y, z, rx, ry, rz, -350 to 350; all zero lets go.
  void deflect(const std::array<std::int16_t, 6>& raw);
  void press(std::uint32_t buttons);  ///< bit i: button i is down from now on

  [[nodiscard]] bool is_lit() const { return is_lit_; }
  [[nodiscard]] int refused() const { return refused_; }  ///< output reports that this device does not know

  [[nodiscard]] HidIdentity identity() const override;
  [[nodiscard]] std::span<const std::byte> report_descriptor() const override { return descriptor_; }
  void take_output(std::span<const std::byte> report, std::int64_t time_ns) override;
  std::size_t give_input(std::span<std::byte> to, std::int64_t time_ns) override;

 private:
  using Report = std::vector<std::byte>;
  [[nodiscard]] Report axes(std::uint8_t id, std::size_t first, std::size_t count) const;

  SpaceMouseReports reports_;
  std::vector<std::byte> descriptor_;
  std::array<std::int16_t, 6> raw_{};
  std::uint32_t buttons_ = 0, told_buttons_ = 0;
  int turns_left_ = 0;  // of reports after the cap was let go
  bool is_second_half_next_ = false;
  std::int64_t next_ns_ = 0;
  bool is_lit_ = false;
  int refused_ = 0;
};

}  // namespace farfeel::test_support
