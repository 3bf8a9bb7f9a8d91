// Whether a device that is new here goes where its force pushes, found before anything is felt with it.
//
// The force of a touch tells little of that: a hand that strikes, shakes or lets go moves the handle as a wrong axis
// would. So the device pushes by itself, at its first grip: short shakes, along all its axes at once, in a code that no
// hand keeps. A shake begins with a segment of tau without force, to see how the hand moves, and then pushes + and -
// along each axis for tau each. Until the end of the first push
//
//   y = x(2 tau) - 2 x(tau) + x(0)
//
// is zero where the hand moves evenly, and lies along the push whatever holds the handle, as it was at rest before:
// F tau^2 / 2 m of a mass, F / K (1 - cos(w tau)) of a mass on a spring, all of the push's work being above zero.
// In shake k axis i pushes with the sign s_ik, of a column of a Hadamard matrix of order 8: columns are orthogonal to
// each other, and to a constant y. So the response G = 1/N sum y_k s_k^T has a column for each axis. What is left of y
// is the hand's own motion, and gives the standard error of G. An axis whose response stands kCertain errors out of it
// and lies along the push is right; one that lies elsewhere is wrong. Where the hand moves too much to tell, the device
// waits for it and goes on shaking. Where it holds the handle so firmly that nothing moves, nothing is told: such a
// force drives no hand away.
//
// Source of the code: Sylvester, Phil. Mag. 34, 1867; of the principle, lock-in detection.
#pragma once

#include <array>
#include <cstddef>

#include "haptic_core/spatial/spatial.h"
#include "master_station/devices/model/device_model.h"

namespace farfeel::devices {

/// Realtime-safe.
class AxisProbe {
 public:
  enum class Verdict { kOpen, kRight, kWrong, kNotTold };

  static constexpr std::size_t kShakes = 8;                ///< of a block, which takes 1 s on most devices
  static constexpr std::size_t kBlocks = 8;                ///< the newest so many are judged
  static constexpr double kCertain = 10;                   ///< standard errors
  static constexpr double kAlong = 0.7, kElsewhere = 0.5;  ///< cosine of push and response: right above, wrong below

  /// max_force_N: the greatest that it may push.
  AxisProbe(const DeviceModel& model, double max_force_N) noexcept;

  /// The handle is at p_BD and moves with v_BD. Returns the force of the tick that begins now.
  [[nodiscard]] glm::dvec3 next(const glm::dvec3& p_BD_m, const glm::dvec3& v_BD_m_s, double dt_s) noexcept;
  /// The hand let go, or nobody saw what it did: the shake that is under way is begun again.
  void interrupt() noexcept { shake_s_ = 0, seen_ = 0; }
  [[nodiscard]] Verdict verdict() const noexcept { return verdict_; }
  /// Metres along each axis for a push along another, column by column: of what was judged last.
  [[nodiscard]] const glm::dmat3& response_m() const noexcept { return response_; }
  [[nodiscard]] double error_m() const noexcept { return error_m_; }  ///< of a component of it

 private:
  void judge() noexcept;
  [[nodiscard]] double sign(std::size_t shake, int axis) const noexcept;

  int axes_;
  double force_N_, step_m_, late_s_, segment_s_ = 0;
  double shake_s_ = 0;
  std::size_t seen_ = 0;  // of the three readings of a shake
  glm::dvec3 first_{0}, second_{0};
  std::array<glm::dvec3, kShakes * kBlocks> y_{};  // a ring of whole blocks
  std::size_t shakes_ = 0;
  glm::dmat3 response_{0};
  double error_m_ = 0;
  Verdict verdict_ = Verdict::kOpen;
};

}  // namespace farfeel::devices
