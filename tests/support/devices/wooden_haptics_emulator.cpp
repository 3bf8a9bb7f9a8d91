#include "tests/support/devices/wooden_haptics_emulator.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfeel::test_support {
namespace {

// The published figures of the device of 2015.
constexpr double kBaseHeight_m = 0.080, kUpperArm_m = 0.205, kForearm_m = 0.245;
constexpr double kCapstan_m = 0.010;
constexpr std::array<double, 3> kBody_m{0.160, 0.120, 0.120};  // diameters, as the capstan's
constexpr double kCountsPerTurn = 2000;
constexpr double kTorqueConstant_Nm_per_A = 0.0259;
const Eigen::Vector3d kOrigin_m{0.220, 0, 0.080};  // of the workspace, in the arm's own axes

// Nobody published these: a light aluminium arm with a hand's damping.
constexpr double kHandleMass_kg = 0.15;
constexpr double kRotorInertia_kg_m2 = 2e-4;  // at the body
constexpr double kFriction_Nms_per_rad = 2e-3;
constexpr double kHandDamping_Ns_per_m = 12;

constexpr std::int64_t kWatchdog_ns = 500'000'000;
constexpr std::int64_t kAnswer_ns = 250'000;  // a full-speed device is asked once a millisecond; this is kinder
constexpr std::int64_t kStep_ns =
    200'000;  // the quickest motion, of the handle on the spring of a hand, has a period of 50 ms
constexpr std::int64_t kLongestCatchUp_ns = 20'000'000;  // a machine that is too slow for it sees a slow arm

std::int16_t int16_at(std::span<const std::byte> bytes, std::size_t i) {
  return static_cast<std::int16_t>(std::to_integer<unsigned>(bytes[1 + 2 * i]) |
                                   std::to_integer<unsigned>(bytes[2 + 2 * i]) << 8);
}

}  // namespace

WoodenHapticsEmulator::WoodenHapticsEmulator() {
  // mbed's own descriptor for raw reports: page 0xFFAB, usage 0x0200, 14 bytes in, 14 bytes out.
  for (const int byte : {0x06, 0xAB, 0xFF, 0x0A, 0x00, 0x02, 0xA1, 0x01, 0x75, 0x08, 0x15, 0x00, 0x26, 0xFF,
                         0x00, 0x95, 14,   0x09, 0x01, 0x81, 0x02, 0x95, 14,   0x09, 0x02, 0x91, 0x02, 0xC0}) {
    descriptor_.push_back(static_cast<std::byte>(byte));
  }
  angles_rad_ = {0.1, -0.2, 1.2};  // as it happened to lie
  put_at(angles_rad_);
  for (int i = 0; i < 3; ++i) counter_offset_[static_cast<std::size_t>(i)] = -counter(i);
}

Eigen::Vector3d WoodenHapticsEmulator::handle_B_m(const Eigen::Vector3d& angles_rad) {
  // The forearm hangs from the upper arm's end: at angle zero it points down, and a turn lifts it forward.
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Vector3d upper_arm = AngleAxisd(angles_rad[1], Vector3d::UnitY()) * Vector3d(0, 0, kUpperArm_m);
  const Vector3d forearm = AngleAxisd(-angles_rad[2], Vector3d::UnitY()) * Vector3d(0, 0, -kForearm_m);
  const Vector3d arm = AngleAxisd(angles_rad[0], Vector3d::UnitZ()) * (upper_arm + forearm);
  const Vector3d handle = arm + Vector3d(0, 0, kBaseHeight_m) - kOrigin_m;
  // The arm's own axes: x towards the person, y to the right.
  return {handle.y(), -handle.x(), handle.z()};
}

Eigen::Matrix3d WoodenHapticsEmulator::jacobian_B(const Eigen::Vector3d& angles_rad) {
  constexpr double kSmall_rad = 1e-6;
  Eigen::Matrix3d J;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = kSmall_rad * Eigen::Vector3d::Unit(i);
    J.col(i) = (handle_B_m(angles_rad + d) - handle_B_m(angles_rad - d)) / (2 * kSmall_rad);
  }
  return J;
}

void WoodenHapticsEmulator::grasp(const Eigen::Vector3d& p_B_m, double stiffness_N_per_m) {
  hand_B_m_ = p_B_m;
  hand_stiffness_N_per_m_ = stiffness_N_per_m;
}

void WoodenHapticsEmulator::put_at(const Eigen::Vector3d& angles_rad) {
  angles_rad_ = angles_rad;
  speeds_rad_s_.setZero();
}

Eigen::Vector3d WoodenHapticsEmulator::motor_torques_Nm() const {
  Eigen::Vector3d torques = Eigen::Vector3d::Zero();
  if (!are_motors_on_) return torques;
  for (std::size_t i = 0; i < 3; ++i) {
    const double motor_Nm = currents_mA_[i] * 1e-3 * kTorqueConstant_Nm_per_A;
    torques[static_cast<int>(i)] = motor_Nm * kBody_m[i] / kCapstan_m;
  }
  return torques;
}

Eigen::Vector3d WoodenHapticsEmulator::motor_force_B_N() const {
  // torques . d angles = F . J d angles, for every d angles.
  return jacobian_B(angles_rad_).transpose().partialPivLu().solve(motor_torques_Nm());
}

std::int16_t WoodenHapticsEmulator::counter(int i) const {
  const auto at = static_cast<std::size_t>(i);
  double counts = 0;  // no encoders at the wrist
  if (i < 3) {
    const double motor_turns = angles_rad_[i] * kBody_m[at] / kCapstan_m / (2 * std::numbers::pi);
    counts = kCountsPerTurn * motor_turns;
  }
  return static_cast<std::int16_t>(std::llround(counts) + counter_offset_[at]);
}

void WoodenHapticsEmulator::move(double dt_s) {
  const Eigen::Matrix3d J = jacobian_B(angles_rad_);
  Eigen::Vector3d F_B_N = push_B_N_;
  if (hand_stiffness_N_per_m_ > 0) {
    F_B_N += hand_stiffness_N_per_m_ * (hand_B_m_ - handle_B_m()) - kHandDamping_Ns_per_m * (J * speeds_rad_s_);
  }
  const Eigen::Vector3d torques = motor_torques_Nm() + J.transpose() * F_B_N - kFriction_Nms_per_rad * speeds_rad_s_;
  const Eigen::Matrix3d inertia =
      kHandleMass_kg * J.transpose() * J + kRotorInertia_kg_m2 * Eigen::Matrix3d::Identity();
  speeds_rad_s_ += dt_s * inertia.ldlt().solve(torques);
  angles_rad_ += dt_s * speeds_rad_s_;
}

void WoodenHapticsEmulator::advance_to(std::int64_t time_ns) {
  if (are_motors_on_ && time_ns - last_packet_ns_ >= kWatchdog_ns) {
    are_motors_on_ = false;
    currents_mA_ = {};
    ++watchdog_trips_;
  }
  if (time_ns - time_ns_ > kLongestCatchUp_ns) time_ns_ = time_ns - kLongestCatchUp_ns;
  for (; time_ns_ + kStep_ns <= time_ns; time_ns_ += kStep_ns) move(static_cast<double>(kStep_ns) * 1e-9);
}

void WoodenHapticsEmulator::take_output(std::span<const std::byte> report, std::int64_t time_ns) {
  advance_to(time_ns);
  if (report.size() != 15 || report[0] != std::byte{0}) {
    ++refused_;
    return;
  }
  last_packet_ns_ = time_ns;
  are_motors_on_ = true;
  if (!is_answer_due_) answer_ns_ = time_ns + kAnswer_ns;
  is_answer_due_ = true;
  const std::int16_t command = int16_at(report, 3);
  if (command == 1) {
    constexpr std::array<std::size_t, 6> kSlots{4, 5, 6, 0, 1, 2};
    for (std::size_t i = 0; i < 6; ++i) {
      counter_offset_[i] += int16_at(report, kSlots[i]) - counter(static_cast<int>(i));
    }
    currents_mA_ = {};
    is_button_pressed_ = false;
  } else {
    if (command != 0) ++refused_;
    for (std::size_t i = 0; i < 3; ++i) currents_mA_[i] = int16_at(report, i);
  }
}

std::size_t WoodenHapticsEmulator::give_input(std::span<std::byte> to, std::int64_t time_ns) {
  advance_to(time_ns);
  if (!is_answer_due_ || time_ns < answer_ns_) return 0;
  is_answer_due_ = false;
  for (int i = 0; i < 7; ++i) {
    const auto value = static_cast<std::uint16_t>(i < 6 ? counter(i) : std::int16_t{is_button_pressed_});
    to[static_cast<std::size_t>(2 * i)] = static_cast<std::byte>(value & 0xFF);
    to[static_cast<std::size_t>(2 * i + 1)] = static_cast<std::byte>(value >> 8);
  }
  return 14;
}

}  // namespace farfeel::test_support
