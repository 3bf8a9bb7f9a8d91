// The master's end of the haptic lane: the loop's Remote over a UDP socket that the haptic thread itself reads and
// writes. Handing datagrams to another thread would cost more than the system calls do.
#pragma once

#include <atomic>
#include <cstdint>

#include "codecs/wire/haptic_messages.h"
#include "haptic_core/contact/doubts.h"
#include "haptic_core/realtime/histogram.h"
#include "haptic_core/realtime/latest_value.h"
#include "master_station/haptic_loop/remote.h"
#include "transport/sequence_window.h"
#include "transport/udp_socket.h"

namespace farfeel::master_station {

class HapticLane final : public Remote {
 public:
  /// Counted by the haptic thread, over all sessions so far.
  struct Counters {
    std::uint64_t poses_sent = 0;
    std::uint64_t poses_unsent = 0;        ///< the kernel took nothing: nobody listens, or its buffer was full
    transport::LaneCounters contact_sets;  ///< `sent` stays 0: the slave knows that
    std::uint64_t malformed = 0;           ///< of this session by their header, but not to be used
    std::uint64_t contacts_left_out = 0;   ///< single contacts that did not fit in their datagram
    contact::DoubtCounts doubts;           ///< of the newest sets
  };

  /// The socket must be connected to the slave's haptic lane.
  explicit HapticLane(transport::UdpSocket socket);

  // The haptic thread. Neither blocks, allocates, locks, throws or logs; without a session both do nothing.
  void send(const ToolState&) noexcept override;
  bool poll(contact::ContactSet& newest) noexcept override;
  [[nodiscard]] teleoperation::LineValue line() const noexcept override {
    return newest_.line.value_or(teleoperation::LineValue{});
  }
  /// Network round trip of the contacts that poll() gave last, without the slave's own time; NaN before any.
  [[nodiscard]] double newest_round_trip_ms() const noexcept { return round_trip_ms_; }

  /// From now on the slave is asked for curvatures, at the pose that the tool will have when the answer is back, 10 ms
  /// ahead at most.
  void want_curvature() noexcept { wants_curvature_ = true; }

  // The io thread.
  /// 0: there is none, or its scene is not the one the loop simulates.
  void set_session(std::uint32_t id) noexcept { session_.store(id, std::memory_order_release); }
  /// When the live session's last good contact set arrived; 0 before any.
  [[nodiscard]] std::int64_t heard_ns() const noexcept { return heard_ns_.load(std::memory_order_relaxed); }

  // One other thread at a time. Wait-free; at most 100 ms old while the haptic thread runs.
  [[nodiscard]] const Counters& counters() noexcept;
  [[nodiscard]] const realtime::Histogram& round_trips() noexcept;

 private:
  void adopt_session() noexcept;
  bool accept(const transport::Received&) noexcept;
  void publish(std::int64_t now_ns) noexcept;

  transport::UdpSocket socket_;
  std::atomic<std::uint32_t> session_{0};
  std::atomic<std::int64_t> heard_ns_{0};
  realtime::LatestValue<Counters> published_counters_;
  realtime::LatestValue<realtime::Histogram> published_round_trips_;

  // The haptic thread's own.
  bool wants_curvature_ = false;
  std::uint32_t ahead_us_ = 0;
  std::uint32_t live_ = 0;
  std::uint32_t sequence_ = 0;
  transport::SequenceWindow window_;
  transport::LaneCounters before_;  // of earlier sessions
  Counters counters_;
  codecs::ContactAnswer newest_;
  std::int64_t newest_arrival_ns_ = 0;
  double round_trip_ms_;
  realtime::Histogram round_trips_;
  std::int64_t published_ns_ = 0;
};

}  // namespace farfeel::master_station
