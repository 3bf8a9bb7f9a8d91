// What crosses between a device's owner (the program farfeel-device) and whoever feels it: plain values.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::devices {

/// Where a device is on its way to force. The driver tells all but kEnabled and kStopping, which the guard adds.
enum class Stage : std::uint8_t {
  kAbsent,    ///< not plugged in, or not to be opened: the advice says what to do
  kOpening,   ///< found; set-up is under way
  kFirmware,  ///< its firmware is being loaded
  kHoming,    ///< it waits to be moved until it knows where it is
  kReady,     ///< readings are good, force is zero
  kEnabled,   ///< and force is on
  kStopping,  ///< force goes to zero
  kFault,     ///< something broke a limit, or does not answer: force is zero
  kTrying     ///< held for the first time: gentle pushes tell where its axes go, and nothing else is felt yet
};

inline constexpr std::size_t kStages = 9;

[[nodiscard]] std::string_view name(Stage) noexcept;

/// How far each axis is deflected, as a share of its full travel, -1 to 1: what a rate input tells.
struct Deflection {
  glm::dvec3 turn{0, 0, 0};  ///< about x, y, z
  glm::dvec3 push{0, 0, 0};  ///< along x, y, z
};

/// The newest that is known of a device, in its own base frame B: right-handed, x to the right, y away from the person,
/// z up, as the driver maps it.
struct Sample {
  std::int64_t time_ns = 0;    ///< CLOCK_MONOTONIC when the newest report came; 0: none yet
  std::int64_t polled_ns = 0;  ///< when the device was last seen to be there, whether it had anything to tell or not
  std::uint64_t reports = 0;   ///< since it was opened
  spatial::Pose X_BD;          ///< what the device does not measure is the identity
  spatial::Twist V_BD_B;       ///< of D's origin, estimated by the driver
  Deflection deflection;       ///< of a rate input
  std::uint32_t buttons = 0;   ///< bit i: button i is down
  std::uint32_t opening = 0;   ///< counts how often the device came: another number is another plugging in
  Stage stage = Stage::kAbsent;

  [[nodiscard]] bool has_button(unsigned i) const noexcept { return ((buttons >> i) & 1U) != 0; }
};

/// What the device is to do until the next.
struct Command {
  std::int64_t time_ns = 0;   ///< CLOCK_MONOTONIC when it was made; older than kStaleCommand_ns counts as zero force
  spatial::Wrench F_hand_B;   ///< on the hand, about D's origin
  std::uint32_t opening = 0;  ///< of the sample that it answers: a command for an earlier plugging in is not obeyed
  bool is_force_on = false;   ///< false: zero force, whatever F_hand_B says
  bool is_light_on = false;   ///< of the device, where it has one
};

inline constexpr std::int64_t kStaleCommand_ns = 10'000'000;  ///< half of the 20 ms in which force is zero, all told
inline constexpr std::int64_t kStaleSample_ns = 20'000'000;

static_assert(std::is_trivially_copyable_v<Sample> && std::is_trivially_copyable_v<Command>);

}  // namespace farfeel::devices
