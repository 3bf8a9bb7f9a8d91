// Whether a hand asks for force: an edge of a button or grip sensor, never its level alone.
#pragma once

#include "master_station/devices/model/device_model.h"

namespace farfeel::devices {

/// Realtime-safe.
class Deadman {
 public:
  explicit Deadman(Enabling how) noexcept : how_(how) {}

  /// is_down: the button, the grip sensor, or the key held at the station. Whatever makes force not allowed takes it
  /// off until the next edge; a button that was down before it is no edge.
  bool next(bool is_allowed, bool is_down) noexcept {
    const bool is_edge = is_down && !was_down_;
    was_down_ = is_down;
    if (!is_allowed) {
      is_on_ = false;
    } else if (how_ == Enabling::kPress) {
      is_on_ = is_on_ != is_edge;
    } else {
      is_on_ = is_down && (is_on_ || is_edge);
    }
    return is_on_;
  }
  void disarm() noexcept { is_on_ = false; }
  [[nodiscard]] bool is_on() const noexcept { return is_on_; }

 private:
  Enabling how_;
  bool was_down_ = true, is_on_ = false;  // down at first: only what is seen to go down counts
};

}  // namespace farfeel::devices
