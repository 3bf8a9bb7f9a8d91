// When a datagram arrived, on a clock that nobody steps.
//
// The kernel stamps arrivals with CLOCK_REALTIME, which an administrator or NTP may step at any moment; everything else
// here counts CLOCK_MONOTONIC. The two run at the same rate (NTP slews both alike), so their difference is constant but
// for steps. It is kept; when it changes, stamps from before and from after the step may wait in the socket side by
// side, and one is believed only if exactly one of the two differences puts it between the datagram before it, or the
// moment when the socket was empty, and now. A second step while they wait, and nothing is believed until the socket
// was empty.
#pragma once

#include <cstdint>

namespace farfeel::transport {

/// CLOCK_MONOTONIC now [ns]. Realtime-safe.
[[nodiscard]] std::int64_t monotonic_ns() noexcept;
/// CLOCK_REALTIME now, since 1970 [ns]. Realtime-safe.
[[nodiscard]] std::int64_t wall_clock_ns() noexcept;

/// Both clocks at one moment.
struct ClockReading {
  std::int64_t monotonic_ns = 0;
  std::int64_t realtime_ns = 0;
  std::int64_t width_ns = 0;  ///< the two were read at most this far apart
};
[[nodiscard]] ClockReading read_clocks() noexcept;

/// One socket's view of both clocks. Time is an argument; realtime-safe.
class ArrivalClock {
 public:
  /// The socket was empty then: it was just opened.
  explicit ArrivalClock(const ClockReading& now) noexcept;

  struct Arrival {
    std::int64_t time_ns;  ///< CLOCK_MONOTONIC; that of `now` if it is not known
    bool is_known;
  };
  /// Of a datagram read at `now` that the kernel stamped with stamp_realtime_ns. In the order of reading.
  [[nodiscard]] Arrival arrival(std::int64_t stamp_realtime_ns, const ClockReading& now) noexcept;
  /// The socket had nothing to read at this time.
  void note_empty(std::int64_t monotonic_ns) noexcept;

 private:
  std::int64_t floor_ns_;           // what is read next arrived later, but for the stamps of different cores
  std::int64_t offset_ns_;          // CLOCK_REALTIME - CLOCK_MONOTONIC
  std::int64_t former_offset_ns_;   // before the last step
  bool was_stepped_again_ = false;  // there are more than two differences
  bool has_former_ = false;         // stamps from before the step may still wait
};

}  // namespace farfeel::transport
