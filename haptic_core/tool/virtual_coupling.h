// The spring and damper in six degrees of freedom that join the device's handle to the simulated tool.
//
// With c = R c_T (from To to the grip point G, in W), e = x_h - x - c and theta = log(R_h R^T):
//   f   = k_t e + b_t (v_h - v - w x c)
//   tau = c x f + k_r theta + b_r (w_h - w)          about To
// after Otaduy & Lin, World Haptics 2005 and IEEE T-RO 22(4), 2006. Colgate, Stanley & Brown 1995 for the idea.
#pragma once

#include "haptic_core/spatial/spatial.h"
#include "haptic_core/tool/linear_response.h"

namespace farfeel::tool {

/// Every field >= 0.
struct CouplingGains {
  double stiffness_N_per_m = 1000;
  double damping_Ns_per_m = 1;
  double rotational_stiffness_Nm_per_rad = 5;
  double rotational_damping_Nms_per_rad = 0.005;
};

class VirtualCoupling {
 public:
  /// X_TG: where the handle's frame sits in the tool when the coupling is at rest.
  VirtualCoupling(const CouplingGains& gains, const spatial::Pose& X_TG) : gains_(gains), X_TG_(X_TG) {}

  struct State {
    LinearResponse on_tool;    ///< about To
    spatial::Wrench F_hand_W;  ///< the reaction, on the handle, about the handle's origin
    double energy_J;           ///< stored in the springs
  };
  /// X_WD, V_WD_W: the handle. Realtime-safe; cannot fail.
  [[nodiscard]] State evaluate(const spatial::Pose& X_WD, const spatial::Twist& V_WD_W, const spatial::Pose& X_WT,
                               const spatial::Twist& V_WT_W) const noexcept;

  /// Where the tool rests for a handle at X_WD.
  [[nodiscard]] spatial::Pose rest_pose(const spatial::Pose& X_WD) const noexcept;
  [[nodiscard]] const CouplingGains& gains() const noexcept { return gains_; }

 private:
  CouplingGains gains_;
  spatial::Pose X_TG_;
};

}  // namespace farfeel::tool
