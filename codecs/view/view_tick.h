// What of a running session the live view shows: the newest tick, and how quantities went between ticks.
#pragma once

#include <array>
#include <limits>

#include "codecs/view/view_messages.h"
#include "haptic_core/local_model/pushes.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::codecs {

/// What is drawn over time, in this order.
enum class ViewSeries : std::uint8_t {
  kForce_N,
  kTorque_Nm,
  kDepth_m,
  kTank_J,
  kCoupling_J,
  kContacts_J,
  kWork_us,
  kRoundTrip_ms,
  kNetwork_ms,
  kNode_ms,
  kAge_ms,
};
inline constexpr std::size_t kViewSeries = 11;

/// A quantity over some ticks; none of them had it: count is 0 and the rest NaN.
struct ViewBin {
  float low = std::numeric_limits<float>::quiet_NaN(), high = low, mean = low;
  std::uint32_t count = 0;
  void add(double value) noexcept;
  void add(const ViewBin&) noexcept;
};

/// A body that moves, or that comes and goes.
struct ViewMoving {
  std::uint16_t body = 0;
  spatial::Pose X_WB;
  bool is_there = true;
};

struct ViewTick {
  static constexpr std::uint8_t kResting = 1u << 0;        ///< of flags: tiles rest
  std::uint64_t number = 0;                                ///< of the tick
  std::int64_t time_ns = 0;                                ///< since the loop started
  std::int64_t told_ns = 0;                                ///< CLOCK_MONOTONIC when the recorder had it
  std::uint8_t state = 0, fault = 0, rung = 0, flags = 0;  ///< master_station's LoopState and Fault
  spatial::Pose X_WT, X_WI;
  spatial::Wrench F_hand_W, F_contact_To_W;
  double depth_max_m = 0;
  std::uint32_t pressing = 0;
  local_model::Pushes pushes;
  std::vector<ViewMoving> moving;
  double view_yaw_rad = 0;  ///< of a device's motions, as the person turned it about z
  std::uint32_t ticks = 0;  ///< that the bins are of
  std::array<ViewBin, kViewSeries> bins;

  /// The same tick, and the bins of one that came before it and was not told.
  void absorb(const ViewTick& earlier) noexcept;
};

/// How it went until now: a time and the bins up to there each, in the order of time.
struct ViewMoment {
  std::int64_t time_ns = 0;
  std::array<ViewBin, kViewSeries> bins;
};
using ViewHistory = std::vector<ViewMoment>;

[[nodiscard]] std::vector<std::byte> write_view(const ViewTick&);
[[nodiscard]] std::vector<std::byte> write_view(const ViewHistory&);

/// Nothing where a byte is missing, too many, or out of its range.
[[nodiscard]] std::optional<ViewTick> read_view_tick(std::span<const std::byte>);
[[nodiscard]] std::optional<ViewHistory> read_view_history(std::span<const std::byte>);

}  // namespace farfeel::codecs
