// Between the handle and its image in the world, which the virtual coupling holds: workspace scale, force scale,
// clutch.
//
// A transformer whose ratio may change at any time. With s the workspace scale, g the force scale, and m the clutch, 1
// when engaged and 0 when held:
//   v_image = m s v_handle     f_hand = m g f_image
//   w_image = m w_handle       t_hand = m (g / s) t_image
// so P_hand = (g / s) P_image at every instant, whatever m does: a world that is passive at the image is passive at the
// hand for all s, g > 0. Turns are never scaled, a person would lose the tool's bearing; hence the torque's g / s.
//
// A stiffness K of the image is felt as m^2 s g K (turning: m^2 K g / s): what a sampled device renders stably is a
// bound on the product of the scales and K, so the coupling's gains are divided by that product (coupling_for).
#pragma once

#include "haptic_core/spatial/spatial.h"

namespace farfeel::master_station {

struct GearScales {
  double workspace = 1;    ///< s > 0: metres of the image per metre of the handle
  double force = 1;        ///< g > 0: newtons on the hand per newton on the image
  bool has_clutch = true;  ///< false: the clutch button does nothing
  [[nodiscard]] double torque() const noexcept { return force / workspace; }
  /// The remote asks for a force scale; the operator's side has the last word on it.
  [[nodiscard]] GearScales with_force_at_most(double most) const noexcept {
    return {workspace, force < most ? force : most, has_clutch};
  }
};

/// Realtime-safe. Everything is in W; the image is I.
class HandleGear {
 public:
  explicit HandleGear(const GearScales& scales) noexcept : scales_(scales) {}

  /// Puts the image at the handle's pose, its position times the workspace scale.
  void start(const spatial::Pose& X_WD) noexcept;
  /// Puts it at X_WI wherever the handle is, which takes hold there as it does after the clutch.
  void take_hold(const spatial::Pose& X_WD, const spatial::Pose& X_WI) noexcept;
  /// The handle moved to X_WD in dt_s. The clutch takes kClutch_s to let go and to take hold again; is_off: the same,
  /// button or not.
  void advance(const spatial::Pose& X_WD, const spatial::Twist& V_WD_W, bool is_clutch_held, double dt_s,
               bool is_off = false) noexcept;
  /// While it has let go, lets the image go to where the coupling rests, so that nothing waits there for the hand
  /// that takes hold again: a pressed tool is let off, a free one stays. Only takes energy out of the coupling.
  void relax_towards(const spatial::Pose& X_WI_rest, double dt_s) noexcept;
  /// While it has let go, leads the image to X_WI_goal at kLead_m_s and kLead_rad_s, and never further than
  /// kAhead_m and kAhead_rad from where the coupling rests: a surface that holds the tool back is not pressed
  /// harder. Whether it is there.
  bool lead_to(const spatial::Pose& X_WI_goal, const spatial::Pose& X_WI_rest, double dt_s) noexcept;

  [[nodiscard]] const spatial::Pose& X_WI() const noexcept { return X_WI_; }
  [[nodiscard]] const spatial::Twist& V_WI_W() const noexcept { return V_WI_W_; }
  /// F_I_W acts on the image about its origin; the result on the hand about the handle's.
  [[nodiscard]] spatial::Wrench on_hand(const spatial::Wrench& F_I_W) const noexcept;
  [[nodiscard]] double engagement() const noexcept { return engagement_; }  ///< m

  static constexpr double kClutch_s = 0.1;
  static constexpr double kLead_m_s = 0.1, kLead_rad_s = 1, kAhead_m = 1e-3, kAhead_rad = 0.02;

 private:
  GearScales scales_;
  spatial::Pose X_WD_, X_WI_;
  spatial::Twist V_WI_W_;
  double engagement_ = 1;
};

}  // namespace farfeel::master_station
