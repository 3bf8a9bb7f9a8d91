// A Remote that lets another thread see the contacts as they pass: pictures and displays need them, the loop does not.
#pragma once

#include "haptic_core/realtime/latest_value.h"
#include "master_station/haptic_loop/remote.h"

namespace farfeel::master_station {

class ContactWitness final : public Remote {
 public:
  /// The remote must outlive it.
  explicit ContactWitness(Remote& remote) : remote_(remote) {}

  void send(const ToolState& state) noexcept override { remote_.send(state); }
  bool poll(contact::ContactSet& newest) noexcept override {
    const bool is_new = remote_.poll(newest);
    if (is_new) seen_.store(newest);
    return is_new;
  }

  bool take_course(motion::ObjectCourse& next) noexcept override { return remote_.take_course(next); }
  [[nodiscard]] teleoperation::LineValue line() const noexcept override { return remote_.line(); }

  /// One other thread. Wait-free; valid until the next call.
  [[nodiscard]] const contact::ContactSet& newest() noexcept {
    seen_.refresh();
    return seen_.latest();
  }

 private:
  Remote& remote_;
  realtime::LatestValue<contact::ContactSet> seen_;
};

}  // namespace farfeel::master_station
