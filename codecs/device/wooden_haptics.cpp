#include "codecs/device/wooden_haptics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptic_core/spatial/spatial.h"
#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {
namespace {

constexpr std::uint8_t kNoId = 0;
constexpr std::int16_t kCurrents = 0, kSetCounts = 1;  // commands

WoodenHapticsPacket packet(const std::array<std::int16_t, 3>& slots, std::int16_t command,
                           const std::array<std::int16_t, 3>& attributes) noexcept {
  WoodenHapticsPacket bytes{};
  transport::ByteWriter out(bytes);
  out.u8(kNoId);
  for (const std::int16_t value : slots) out.u16(static_cast<std::uint16_t>(value));
  out.u16(static_cast<std::uint16_t>(command));
  for (const std::int16_t value : attributes) out.u16(static_cast<std::uint16_t>(value));
  return bytes;
}

// From the arm's own axes.
glm::dvec3 in_B(const glm::dvec3& v) noexcept {
  return {v.y, -v.x, v.z};
}

// How far a body turns with one turn of its motor.
glm::dvec3 gear(const WoodenHapticsArm& arm) noexcept {
  return arm.direction * arm.capstan_diameter_m / arm.body_diameter_m;
}

}  // namespace

std::optional<WoodenHapticsAnswer> read_wooden_haptics(std::span<const std::byte> report) noexcept {
  if (report.size() != kWoodenHapticsReportBytes) return std::nullopt;
  transport::ByteReader in(report);
  if (in.u8() != kNoId) return std::nullopt;
  WoodenHapticsAnswer answer;
  for (std::int16_t& count : answer.counts) count = static_cast<std::int16_t>(in.u16());
  answer.asks_to_home = in.u16() == 1;
  return answer;
}

WoodenHapticsPacket wooden_haptics_currents(const std::array<std::int16_t, 3>& currents_mA) noexcept {
  return packet(currents_mA, kCurrents, {});
}

WoodenHapticsPacket wooden_haptics_counts(const std::array<std::int16_t, 6>& counts) noexcept {
  return packet({counts[3], counts[4], counts[5]}, kSetCounts, {counts[0], counts[1], counts[2]});
}

glm::dvec3 body_angles_rad(const WoodenHapticsArm& arm, const std::array<std::int16_t, 6>& counts) noexcept {
  const glm::dvec3 turns = glm::dvec3(counts[0], counts[1], counts[2]) / arm.counts_per_turn;
  return 2 * std::numbers::pi * turns * gear(arm);
}

bool can_reach(const WoodenHapticsArm& arm, const glm::dvec3& angles_rad) noexcept {
  return glm::all(glm::greaterThanEqual(angles_rad, arm.min_angle_rad)) &&
         glm::all(glm::lessThanEqual(angles_rad, arm.max_angle_rad));
}

glm::dvec3 handle_B_m(const WoodenHapticsArm& arm, const glm::dvec3& a) noexcept {
  const double reach = arm.upper_arm_m * std::sin(a.y) + arm.forearm_m * std::sin(a.z);
  const double height = arm.base_height_m + arm.upper_arm_m * std::cos(a.y) - arm.forearm_m * std::cos(a.z);
  return in_B(glm::dvec3(std::cos(a.x) * reach, std::sin(a.x) * reach, height) - arm.origin_m);
}

glm::dmat3 handle_jacobian_B(const WoodenHapticsArm& arm, const glm::dvec3& a) noexcept {
  const double reach = arm.upper_arm_m * std::sin(a.y) + arm.forearm_m * std::sin(a.z);
  const glm::dvec3 forward(std::cos(a.x), std::sin(a.x), 0), sideways(-std::sin(a.x), std::cos(a.x), 0), up(0, 0, 1);
  return {in_B(reach * sideways), in_B(arm.upper_arm_m * (std::cos(a.y) * forward - std::sin(a.y) * up)),
          in_B(arm.forearm_m * (std::cos(a.z) * forward + std::sin(a.z) * up))};
}

std::array<std::int16_t, 3> motor_currents_mA(const WoodenHapticsArm& arm, const glm::dvec3& angles_rad,
                                              const glm::dvec3& F_hand_B_N) noexcept {
  const glm::dvec3 body_torques_Nm = glm::transpose(handle_jacobian_B(arm, angles_rad)) * F_hand_B_N;
  glm::dvec3 current_A = body_torques_Nm * gear(arm) / arm.torque_constant_Nm_per_A;
  if (!spatial::is_finite(current_A)) return {};
  const double greatest_A = std::max({std::abs(current_A.x), std::abs(current_A.y), std::abs(current_A.z)});
  const double limit_A = std::min(arm.max_current_A, INT16_MAX * 1e-3);
  if (greatest_A > limit_A) current_A *= limit_A / greatest_A;
  // Towards zero: rounding never exceeds the limit, nor what was asked.
  const auto milliamperes = [](double A) { return static_cast<std::int16_t>(std::trunc(1e3 * A)); };
  return {milliamperes(current_A.x), milliamperes(current_A.y), milliamperes(current_A.z)};
}

}  // namespace farfeel::codecs
