// One pose of six from the devices at hand: a primary device moves the tool, and its orientation comes from the same
// device, from a second one, from a button-held twist, or stays as it is.
//
// The hand's base frame B has the axes of the view: x to the right, y away, z up. Every device tells its motion in a
// base frame of its own, P of the primary, with the same axes unless R_BP says otherwise. Positions are metres of the
// handle: workspace scale, force scale and the clutch's slow letting go are the gear's (haptic_loop/handle_gear.h).
//
// All that crosses is motion, not place. With R = R_view R_BP, and v, w the primary's twist in P:
//   v_D = a R v                                           a  1; 0 while the twist is held
//   w_D = c R w + e w_second + b k A' R v                 c, e, b  1 for where the orientation comes from, else 0
// A turn of the view, another source, a device that comes back: each changes a factor, and a pose that is the sum of
// motions has no step. a, b, c, e take kChange_s from one value to another, so that the twist has none either.
// On the way back force is mapped by the transpose of the same matrix,
//   f = R^T (a F + k b A'^T T)     t = R^T c T            F, T: force and torque on the hand in B
// so that f v + t w = F v_D + T (w_D - e w_second) at every instant: the mapping makes no work of its own. During a
// twist the hand therefore feels the tool's torque as a force, and no force.
//
// What no device renders is masked, and told. A rate input feels nothing, so its rate yields instead: of the part that
// goes against the force, nothing is left at kYield_N, and against the torque at kYield_Nm. It cannot wind the coupling
// up on a wall, nor press harder than that.
//
// A twist is the turn of a ball whose front the hand holds: to the right turns it about z, up about -x, away about y.
#pragma once

#include <atomic>
#include <cstdint>

#include "master_station/devices/device.h"
#include "master_station/devices/hand/follower.h"
#include "master_station/devices/hand/rate_control.h"
#include "master_station/devices/hand/source_device.h"

namespace farfeel::devices {

enum class OrientationFrom : std::uint8_t {
  kOwn,     ///< the primary tells it
  kSecond,  ///< a second device, by its pose or its rate
  kTwist,   ///< while a button is held, moving the handle turns the tool
  kFixed    ///< nothing turns the tool
};

/// What a primary with, or without, a second device can best do.
[[nodiscard]] OrientationFrom default_orientation(const DeviceModel& primary, bool has_second) noexcept;
/// The first button of the primary that neither enables nor holds the clutch.
[[nodiscard]] int default_twist_button(const DeviceModel& primary) noexcept;

struct HandSettings {
  OrientationFrom orientation = OrientationFrom::kFixed;
  int twist_button = 0;        ///< of the primary, from 0
  Axes axes = Axes::kAll;      ///< of a primary that is a rate input
  double rate_speed_m_s = 0;   ///< of the tool at full deflection; turning in proportion. 0: as the model says
  double workspace_scale = 1;  ///< the gear's: rates are the tool's
  double reach_m = 0.25;       ///< of the tool about its start, along each axis, where a rate moves it
  spatial::Pose X_BD_start;    ///< where the tool starts, wherever the handle is held then; metres of the handle
  glm::dquat R_BP{1, 0, 0, 0}, R_BSecond{1, 0, 0, 0};  ///< from a device's base to the view
};

class Hand final : public master_station::Device {
 public:
  /// All outlive the hand. guarded: what is read and felt of the primary: the guard around it, so that caps and walls
  /// come after the mapping; or the primary itself. second: turns the tool where the orientation comes from it. view: a
  /// rate input whose turn about z turns the view, and with it the mapping. Either may be null.
  Hand(SourceDevice& primary, master_station::Device& guarded, SampleSource* second, SampleSource* view,
       const HandSettings&) noexcept;

  // Realtime-safe, one thread.
  /// Of what write() takes: always a whole wrench, to yield to it and to tell what is masked. What of it is rendered is
  /// the model's force_dof and torque_dof. For a twist the coupling is as soft in rotation as its lever asks.
  [[nodiscard]] const master_station::DeviceCapabilities& capabilities() const noexcept override {
    return capabilities_;
  }
  /// is_live is the primary's. A primary that tells what is not finite is passed on as such. A second device that is
  /// gone or not finite turns nothing.
  [[nodiscard]] master_station::DeviceState read(std::int64_t time_ns) noexcept override;
  void write(const spatial::Wrench& F_hand_B) noexcept override { (void)render(F_hand_B, {}); }
  /// Returns what the hand gets, in B: of a twist, the force that stands for the torque.
  [[nodiscard]] spatial::Wrench render(const spatial::Wrench& F_hand_B,
                                       const master_station::Circumstances&) noexcept override;
  void reset() noexcept override { guarded_.reset(); }
  /// X_BD is X_BD_start again: a rate input has its whole reach there.
  void recentre() noexcept override;
  [[nodiscard]] double hand_energy_J() const noexcept override { return guarded_.hand_energy_J(); }

  // Any thread.
  /// What the devices cannot do is kFixed; so is a twist, unless the hand was made with it: its coupling is softer.
  void take_orientation_from(OrientationFrom from) noexcept { orientation_.store(from, std::memory_order_relaxed); }
  /// Of the newest wrench, what no device renders.
  [[nodiscard]] double masked_torque_Nm() const noexcept override {
    return masked_torque_Nm_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] double masked_force_N() const noexcept { return masked_force_N_.load(std::memory_order_relaxed); }
  /// False: the orientation is to come from a second device, which is silent.
  [[nodiscard]] bool is_orientation_live() const noexcept {
    return is_orientation_live_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] double view_yaw_rad() const noexcept { return view_yaw_rad_.load(std::memory_order_relaxed); }
  /// The middle of the device's workspace is where the tool started, or the person has clutched since.
  [[nodiscard]] bool is_centred() const noexcept { return is_centred_.load(std::memory_order_relaxed); }

  /// As long as the clutch takes: 3 N go and come at 0.03 N a tick.
  static constexpr double kChange_s = 0.1;
  /// A quarter turn for 0.1 m of the handle.
  static constexpr double kTwist_rad_per_m = 15.7;
  /// The tool's start is brought under the middle of the workspace by so much of each motion of the handle: little
  /// enough not to be noticed, and all of a desktop workspace's half within a few strokes.
  static constexpr double kCentring = 0.2;
  /// While less is felt than this. A surface, once felt, stays where it is.
  static constexpr double kFree_N = 0.2;
  /// Encoders that chatter by less are no motion of the handle to centre by.
  static constexpr double kCentringSlack_m = 0.5e-3;
  /// As hard as a person presses to feel a surface.
  static constexpr double kYield_N = 3, kYield_Nm = 0.1;

 private:
  [[nodiscard]] bool is_rate() const noexcept { return primary_.model().tells == Tells::kRate; }
  void change_factors(const Sample& primary, bool is_clutch_held, double dt_s) noexcept;
  void turn_view(std::int64_t time_ns, bool is_on, double dt_s) noexcept;
  [[nodiscard]] Motion primary_motion_B(const Sample&, bool is_on, bool is_clutch_held, double dt_s) noexcept;
  [[nodiscard]] Motion second_motion_B(std::int64_t time_ns, bool is_on, double dt_s) noexcept;
  [[nodiscard]] Motion rate_motion_B(RateControl&, const Sample&, const DeviceModel&, const glm::dquat& R, bool is_on,
                                     double dt_s) const noexcept;
  void begin(const Sample&) noexcept;
  void centre(const Sample&, Motion& handle_B) noexcept;
  void move(const Motion& handle_B, const Motion& second_B, double dt_s) noexcept;
  [[nodiscard]] glm::dvec3 twist_of(const glm::dvec3& moved_B) const noexcept;
  [[nodiscard]] glm::dvec3 force_of_twist(const glm::dvec3& torque_B) const noexcept;

  SourceDevice& primary_;
  master_station::Device& guarded_;
  SampleSource* second_;
  SampleSource* view_;
  HandSettings settings_;
  master_station::DeviceCapabilities capabilities_;
  RateControl primary_rate_, second_rate_, view_rate_;
  Follower primary_follower_, second_follower_;
  spatial::Pose X_BD_;
  glm::dquat R_view_{1, 0, 0, 0};
  double moving_ = 1, twisting_ = 0, own_turns_ = 0, second_turns_ = 0;  // a, b, c, e
  glm::dvec3 off_centre_B_m_{0};                                         // what centring still has to do
  glm::dvec3 p_PTrail_P_m_{0};  // a point that the handle drags behind it on a string of kCentringSlack_m
  bool has_begun_ = false, was_twisting_ = false;
  std::int64_t time_ns_ = 0;
  std::uint32_t opening_ = 0;
  spatial::Twist V_BD_B_;
  spatial::Wrench F_hand_B_;  // as written last
  std::atomic<OrientationFrom> orientation_;
  std::atomic<bool> is_orientation_live_{true}, is_centred_{false};
  std::atomic<double> masked_torque_Nm_{0}, masked_force_N_{0}, view_yaw_rad_{0};
};

}  // namespace farfeel::devices
