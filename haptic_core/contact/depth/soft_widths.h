// How wide each contact's soft maximum is: as sharp as asked for, unless that makes a contact stiffer than the loop
// that renders it can hold.
//
// A contact's stiffness is k (g g^T + depth H), and where two peaks compete, or a slope runs away at a silhouette, H
// holds the gradients' covariance over the soft width: widening softens it in proportion. Only the gradient g and its
// derivative H are of that width. The depth stays that of the width as asked for (penetration/two_widths.h): one that
// grew with the width would make the contact stiffer, and widen it again.
#pragma once

#include <cstdint>

#include "haptic_core/contact/tracking/per_track.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

/// Largest eigenvalue of k (g g^T + depth H) in N/m, or up to an eighth more: by squaring the matrix three times, for a
/// hundredth of an eigenvalue solver's time. Gradient and Hessian are about To; rotations count as the motion they make
/// at arm_m. 0 where something is not finite. Realtime-safe.
[[nodiscard]] double stiffness_bound_N_per_m(double k_N_per_m, double depth_m, const spatial::Vector6& gradient,
                                             const spatial::Matrix6& hessian, double arm_m) noexcept;

struct SoftWidthOptions {
  double least_m = 10e-6;             ///< the width as asked for
  double most_m = 200e-6;             ///< never wider
  double most_stiffness_N_per_m = 0;  ///< what the loop can hold; 0: never widen
  double widen_s = 2e-3;              ///< time in which a width may grow e-fold
  double narrow_s = 2;                ///< and shrink, where the contact is clearly softer than the loop can hold
};

/// Remembers each contact's width. Realtime-safe; one thread.
class SoftWidths {
 public:
  explicit SoftWidths(const SoftWidthOptions& options) : options_(options) {}

  /// An answer begins, dt_s after the one before: contacts that were not noted in that one are forgotten.
  void begin_answer(double dt_s) noexcept;

  [[nodiscard]] double width_m(std::uint32_t id) const noexcept;
  /// Whether this contact may be too stiff, as it was last seen, or is wider than asked for: then it should be judged.
  [[nodiscard]] bool wants_judging(std::uint32_t id) const noexcept;
  /// Moves the width of this contact, from the next answer on, towards where its stiffness is what the loop can hold,
  /// no faster than the options say and not at all for less than a hundredth. One that shrank as fast as it grows would
  /// swing with the tool that it moves. depth_m is that of the width as asked for.
  void judge(std::uint32_t id, double k_N_per_m, double depth_m, const spatial::Vector6& gradient,
             const spatial::Matrix6& hessian, double arm_m) noexcept;
  /// The same contact goes on under another name; nothing where the one is unknown or the other known.
  void rename(std::uint32_t from, std::uint32_t to) noexcept;
  /// A contact of this answer, after it was judged.
  void note(std::uint32_t id, double k_N_per_m, double depth_m) noexcept;
  void restart() noexcept { entries_.restart(); }

 private:
  struct Entry {
    double width_m = 0;  ///< 0: new
    double since_judged_s = 0;
    double softer_s = 0;             ///< clearly softer than it must be, or since the last narrowing
    double most_likely_N_per_m = 0;  ///< what the stiffness could be with slopes of one against each other
  };

  SoftWidthOptions options_;
  PerTrack<Entry> entries_;
};

}  // namespace farfeel::contact
