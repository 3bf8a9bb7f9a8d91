#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <thread>

#include "tests/hardware_lab/hid_gadget.h"
#include "tests/hardware_lab/lab_device.h"
#include "tests/hardware_lab/nodes.h"
#include "tests/support/devices/wooden_haptics_emulator.h"

namespace farfeel::hardware_lab {
namespace {

constexpr unsigned kReportBytes = 14;
constexpr double kLower_m = 0.06;  // the hand goes so far below the middle
constexpr double kUnhurried_m_s = 0.5;
constexpr double kAside_m = 0.02;  // far enough to count as moved
constexpr double kMoving_s = 0.3, kPressed_s = 0.7, kTurn_s = 1.2;
constexpr double kSoft_N_per_m = 150;   // an arm that presses
constexpr double kFirm_N_per_m = 1000;  // and one that holds

/// Upper arm upright, forearm level.
Eigen::Vector3d neutral_B_m() {
  test_support::WoodenHapticsEmulator arm;
  arm.put_at({0, 0, std::numbers::pi / 2});
  return arm.handle_B_m();
}

class LabWoodenHaptics final : public LabDevice {
 public:
  [[nodiscard]] std::string argument() const override { return "wooden-haptics"; }
  [[nodiscard]] std::string node() const override {
    const auto id = emulator_.identity();
    return hidraw_node(id.vendor, id.product);
  }
  void plug_in() override {
    emulator_ = test_support::WoodenHapticsEmulator();  // its power comes through the plug
    gadget_.plug_in();
  }
  bool plug_in_as_stranger() override {
    gadget_.plug_in(true);
    return true;
  }
  std::int64_t pull_out() override { return gadget_.pull_out(); }

  /// Into the neutral pose, held there, and the button of its board.
  void make_ready(double t_s) override {
    const double in_turn_s = std::fmod(t_s, kTurn_s);
    hold(neutral_B_m_ + Eigen::Vector3d(0, 0, in_turn_s < kMoving_s ? kAside_m : 0), kFirm_N_per_m);
    if (in_turn_s > kPressed_s) {
      const std::scoped_lock lock(gadget_.mutex());
      emulator_.press_button();
    }
  }
  void rest() override { hold(neutral_B_m_, kFirm_N_per_m); }
  /// From the neutral pose, which lies above the workspace, straight down to the height of the workspace's middle.
  void lift() override {
    const Eigen::Vector3d from_B_m = held_B_m_, way_B_m = at_height_B_m_ - from_B_m;
    const std::int64_t since_ns = now_ns();
    for (double share = 0; way_B_m.norm() > 0 && share < 1;) {
      share = std::min(1.0, kUnhurried_m_s * 1e-9 * static_cast<double>(now_ns() - since_ns) / way_B_m.norm());
      hold(from_B_m + share * way_B_m, kFirm_N_per_m);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  void press_down() override { hold(at_height_B_m_ - Eigen::Vector3d(0, 0, kLower_m), kSoft_N_per_m); }
  void grip(bool) override {}  // its button is for homing
  [[nodiscard]] bool has_key_at_station() const override { return true; }
  [[nodiscard]] bool has_force() const override { return true; }
  [[nodiscard]] double force_N() override {
    const std::scoped_lock lock(gadget_.mutex());
    emulator_.advance_to(now_ns());
    return emulator_.are_motors_on() ? emulator_.motor_force_B_N().norm() : 0;
  }
  [[nodiscard]] int own_watchdog_trips() override {
    const std::scoped_lock lock(gadget_.mutex());
    return emulator_.watchdog_trips();
  }

 private:
  void hold(const Eigen::Vector3d& p_B_m, double stiffness_N_per_m) {
    held_B_m_ = p_B_m;
    const std::scoped_lock lock(gadget_.mutex());
    emulator_.grasp(p_B_m, stiffness_N_per_m);
  }

  test_support::WoodenHapticsEmulator emulator_;
  const Eigen::Vector3d neutral_B_m_ = neutral_B_m();
  const Eigen::Vector3d at_height_B_m_{neutral_B_m_.x(), neutral_B_m_.y(), 0};
  Eigen::Vector3d held_B_m_ = neutral_B_m_;
  HidGadget gadget_{emulator_, kReportBytes};
};

}  // namespace

std::unique_ptr<LabDevice> make_wooden_haptics() {
  return std::make_unique<LabWoodenHaptics>();
}

}  // namespace farfeel::hardware_lab
