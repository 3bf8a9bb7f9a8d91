// 3Dconnexion's SpaceMouse family: how far the cap is deflected, buttons, and a ring of light. A rate input without
// force. It speaks only when something changes: while it is there, silence means the last report.
#pragma once

#include <memory>

#include "codecs/device/space_mouse.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/channel/channel.h"
#include "master_station/devices/driver/driver.h"

namespace farfeel::devices {

class SpaceMouseDriver final : public Driver {
 public:
  using Clock = std::int64_t (*)() noexcept;  ///< CLOCK_MONOTONIC [ns], but in tests

  SpaceMouseDriver(std::unique_ptr<HidChannel>, FoundDevice, Clock = realtime::monotonic_now_ns);

  [[nodiscard]] const FoundDevice& identity() const noexcept override { return identity_; }
  /// Ready from the first step, with the cap at rest until it tells otherwise. Force that is asked of it is not
  /// rendered: it has none.
  Stage step(std::int64_t deadline_ns, const Command&, Sample& newest) override;
  [[nodiscard]] std::string advice() const override;

 private:
  void set_light(bool is_on) noexcept;
  void ask_whether_it_is_there() noexcept;

  std::unique_ptr<HidChannel> channel_;
  FoundDevice identity_;
  Clock now_ns_;
  codecs::SpaceMouseDecoder decoder_;
  bool is_gone_ = false;
  bool is_lit_ = false;
  int light_tries_left_;  // 0: the device has been told, or refuses
  std::int64_t time_ns_ = 0, polled_ns_ = 0, asked_ns_ = 0;
  std::uint64_t reports_ = 0;
};

extern const DriverFamily kSpaceMouseFamily;

}  // namespace farfeel::devices
