// How one direction of a lane behaves, as its arrivals tell: one-way time above its least, jitter, bytes, marks.
//
//   transit = arrival - sent            two clocks, so only differences of it mean anything
//   excess  = transit - least transit of the last 2 s
//   jitter += (|transit - the one before| - jitter) / 16          RFC 3550, 6.4.1
//
// Realtime-safe; for one thread.
#pragma once

#include <array>
#include <cstdint>

#include "haptic_core/realtime/histogram.h"
#include "transport/net/datagram.h"

namespace farfeel::transport {

class ArrivalMeter {
 public:
  /// An authentic datagram, whatever is in it.
  void on_datagram(const Received&) noexcept;
  /// A transit. Clocks that count microseconds and wrap at 2^32 will do.
  void on_transit(std::uint32_t sent_us, std::uint32_t arrived_us) noexcept;

  [[nodiscard]] std::uint64_t bytes() const noexcept { return bytes_; }
  [[nodiscard]] std::uint64_t congestion_marks() const noexcept { return congestion_marks_; }
  [[nodiscard]] int dscp() const noexcept { return dscp_; }  ///< of the newest; -1: not told
  [[nodiscard]] const realtime::Histogram& excess() const noexcept { return excess_; }
  [[nodiscard]] double jitter_us() const noexcept { return jitter_us_; }  ///< 0 before two

 private:
  static constexpr std::size_t kSlices = 8;
  static constexpr std::uint32_t kSlice_us = 250'000;  // eight make the window of 2 s

  std::uint64_t bytes_ = 0, congestion_marks_ = 0;
  int dscp_ = -1;
  bool has_any_ = false;
  std::uint32_t first_us_ = 0;        // the first transit: the others are told from there
  std::uint32_t slice_began_us_ = 0;  // of the arrivals' clock
  std::size_t slice_ = 0;
  std::array<std::int32_t, kSlices> least_us_{};
  std::int32_t last_us_ = 0;
  double jitter_us_ = 0;
  realtime::Histogram excess_;
};

}  // namespace farfeel::transport
