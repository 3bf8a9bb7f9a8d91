// A tick where the tool touches seven times at once: seven tables in one place, and what it costs.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/spatial/spatial.h"
#include "master_station/haptic_loop/tick_record.h"

namespace farfeel::bench {

/// A haptic loop at 4 kHz that has all heights; the remote is alive and tells of no contact. One thread, and time is
/// the tick's number.
class SevenContacts {
 public:
  static constexpr std::int64_t kTick_ns = 250'000;
  /// The handle's pose at a time of the loop [ns].
  using Handle = std::function<spatial::Pose(std::int64_t time_ns)>;

  /// The surfaces must outlive it.
  SevenContacts(const geometry::HapticSurface& table, const geometry::HapticSurface& tool, Handle handle);
  ~SevenContacts();
  SevenContacts(const SevenContacts&) = delete;
  SevenContacts& operator=(const SevenContacts&) = delete;

  /// Tick number i, from 1 on.
  void tick(int i);
  [[nodiscard]] master_station::TickRecord last_record();

  /// Ridged plates: 1.5 mm pitch under a curved one.
  [[nodiscard]] static geometry::HapticSurface usual_table();
  [[nodiscard]] static geometry::HapticSurface usual_tool();
  /// To and fro over 20 mm, 0.6 mm deep.
  [[nodiscard]] static Handle usual_handle();
  /// How long that takes [s].
  [[nodiscard]] static double usual_length_s();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct TickTimes {
  std::uint32_t contacts = 0;  ///< felt from tiles in the last tick
  double p50_us = 0, p99_us = 0, p99_9_us = 0;
};
/// Of the usual ones, each contact a window of 64 x 64 texels.
[[nodiscard]] TickTimes time_seven_contacts(int ticks);

}  // namespace farfeel::bench
