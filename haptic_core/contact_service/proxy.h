// Where depth is looked up: the tool's own pose while the tool is shallow, and where it is deep the place that its path
// has led to without going deeper than the surfaces can tell.
//
// Surfaces know which way is out only near themselves. Deeper than about half of what is thick there, the nearest way
// out is another one: through a wall, out of a fin's far side, or back through the tool. A hand of a few newtons sinks
// a tool that deep into a soft contact. So the depth is looked up at the proxy, a pose X_WP of the tool's own rotation
// that lags behind the tool; between the two the depth is drawn on as a line,
//   depth(X_WT) = depth(X_WP) + g . (p_WT - p_WP),     g = d depth / d translation at the proxy.
// The proxy is the place nearest to the tool that no contact holds back: for each, the greater of the felt and the
// coarse pieces' depth, plus g . (its way), is at most what contact/deepest.h allows. It walks there from where it was,
// so that a wall which the tool has passed through since is still in front of it.
// Source: the god object of Zilles and Salisbury 1995, let in by a stated depth.
#pragma once

#include <array>
#include <cstdint>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact_service {

/// In each answer: set_out, then go_on while it may; the contacts near the place it came to are noted before the next
/// of either. Realtime-safe; one thread.
class Proxy {
 public:
  /// The tool is at X_WT now, dt_s after the last time. The proxy takes over the rotation. The first time after a
  /// restart, and where the tool has gone 60 mm and more since the last, it takes over the place, too. moving: what
  /// objects have done since.
  void set_out(const spatial::Pose& X_WT, double dt_s, const motion::MovingObjects& moving) noexcept;
  /// Goes towards the tool, by what the contacts noted at its place allow and no farther than reach_m, within which all
  /// contacts are known. Returns whether it may go farther once they are noted anew.
  bool go_on(double reach_m) noexcept;
  void begin_contacts() noexcept { count_ = 0; }
  /// A contact as found at the proxy: its gradient is about To, in W. allowed_m: how much deeper than there it may be
  /// looked up; < 0: it is too deep there.
  void note(const contact::Contact& at_proxy, double allowed_m) noexcept;
  void restart() noexcept { has_place_ = false; }

  [[nodiscard]] const spatial::Pose& X_WP() const noexcept { return X_WP_; }
  /// p_WT - p_WP; zero while the tool is shallow.
  [[nodiscard]] glm::dvec3 p_PT_W() const noexcept { return X_WT_.p - X_WP_.p; }
  /// The contact as it is at the tool's pose.
  [[nodiscard]] contact::Contact drawn_on(contact::Contact at_proxy) const noexcept;

 private:
  struct Row {
    spatial::Vector6 gradient;
    double allowed_m;  ///< how much deeper than at the proxy it may be looked up; < 0: it is too deep there
    std::uint32_t object;
  };
  [[nodiscard]] glm::dvec3 nearest_allowed() const noexcept;

  std::array<Row, contact::kMaxContacts> rows_{};
  std::uint32_t count_ = 0;
  spatial::Pose X_WP_, X_WT_;
  double way_left_m_ = 0;  ///< how far it may still go in this answer
  bool has_place_ = false;
};

}  // namespace farfeel::contact_service
