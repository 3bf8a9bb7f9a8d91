// The master's end of the haptic lane: the loop's Remote over a UDP socket that the haptic thread itself reads and
// writes, and whose datagrams it seals and opens itself. Handing them to another thread would cost more than that does.
// Handshakes, which cost a tick's worth, are the io thread's: what comes of them goes there, keys come back.
#pragma once

#include <atomic>
#include <cstdint>

#include "codecs/wire/answer_message.h"
#include "codecs/wire/pose_message.h"
#include "haptic_core/contact/doubts.h"
#include "haptic_core/realtime/histogram.h"
#include "haptic_core/realtime/latest_value.h"
#include "haptic_core/realtime/spsc_queue.h"
#include "master_station/haptic_loop/remote.h"
#include "transport/lane/arrival_meter.h"
#include "transport/lane/sealed_lane.h"
#include "transport/net/datagram.h"
#include "transport/net/udp_socket.h"
#include "transport/net/wait_set.h"

namespace farfeel::master_station {

class HapticLane final : public Remote {
 public:
  /// Counted by the haptic thread, over all sessions so far.
  struct Counters {
    std::uint64_t poses_sent = 0;
    std::uint64_t poses_unsent = 0;        ///< the kernel took nothing: nobody listens, or its buffer was full
    transport::LaneCounters contact_sets;  ///< `sent` stays 0: the slave knows that
    std::uint64_t malformed = 0;           ///< authentic, but not to be used
    std::uint64_t contacts_left_out = 0;   ///< single contacts that did not fit in their datagram
    contact::DoubtCounts doubts;           ///< of the newest sets
  };

  /// How long datagrams take and what they weigh, over all sessions so far.
  struct Meters {
    realtime::Histogram round_trips;  ///< without the slave's computing, with its waiting
    transport::ArrivalMeter up, down;
    transport::LaneRejects rejects;
    std::uint64_t sent_bytes = 0, handshakes = 0;
  };

  /// The socket is connected to the slave, or else set_path() tells where that is. for_io wakes the io thread when a
  /// handshake's datagram waits.
  HapticLane(transport::UdpSocket socket, const transport::WakeEvent& for_io);

  // The haptic thread. Neither blocks, allocates, locks, throws or logs; without a session both do nothing.
  void send(const ToolState&) noexcept override;
  bool poll(contact::ContactSet& newest) noexcept override;
  bool take_course(motion::ObjectCourse& next) noexcept override { return courses_.pop(next); }
  [[nodiscard]] teleoperation::LineValue line() const noexcept override {
    return newest_.line.value_or(teleoperation::LineValue{});
  }
  /// Round trip of the contacts that poll() gave last, without the slave's computing but with what the pose waited in
  /// its socket and for its thread; NaN before any.
  [[nodiscard]] double newest_round_trip_ms() const noexcept { return round_trip_ms_; }

  /// From now on the slave is asked for curvatures, at the pose that the tool will have when the answer is back, 10 ms
  /// ahead at most.
  void want_curvature() noexcept { wants_curvature_ = true; }

  // The io thread.
  /// The session that the loop's poses may go to, and the grid that its poses lie on; id 0: there is none, or its scene
  /// is not the one the loop simulates.
  struct Session {
    std::uint32_t id = 0;
    codecs::PoseGrid grid{};
  };
  void set_session(const Session& session) noexcept { session_.store(session); }
  /// Made by a handshake of that session. False: the haptic thread has not caught up, try again.
  [[nodiscard]] bool give_keys(const transport::LaneKeys& keys) noexcept { return keys_.push(keys); }
  /// What an object does from a scene time on. False: the haptic thread has not caught up, try again.
  [[nodiscard]] bool set_out(const motion::ObjectCourse& told) noexcept { return courses_.push(told); }
  /// A handshake's datagram that came on this lane.
  [[nodiscard]] bool take_handshake(transport::RawDatagram& datagram) noexcept { return handshakes_.pop(datagram); }
  /// One from this end. The kernel lets two threads send.
  void send_handshake(std::span<const std::byte> datagram) noexcept { socket_.send(datagram); }
  /// From a socket that is not connected: a handshake, or what is for a relay.
  void send_to(const transport::Address& to, std::span<const std::byte> datagram) noexcept {
    socket_.send_to(to, datagram);
  }
  /// Of a socket that is not connected: where the haptic thread sends from now on.
  void set_path(const transport::Address& to) noexcept { path_.store(to); }
  /// After a silence: this machine may have got another address.
  bool follow_local_address(const transport::Address& slave) noexcept { return socket_.follow_local_address(slave); }
  /// When the last authentic datagram arrived; 0 before any.
  [[nodiscard]] std::int64_t heard_ns() const noexcept { return heard_ns_.load(std::memory_order_relaxed); }
  /// When the haptic thread last sent or would have; 0 before it runs.
  [[nodiscard]] std::int64_t used_ns() const noexcept { return used_ns_.load(std::memory_order_relaxed); }

  // One other thread at a time. Wait-free; at most 100 ms old while the haptic thread runs.
  [[nodiscard]] const Counters& counters() noexcept;
  [[nodiscard]] const Meters& meters() noexcept;

 private:
  void adopt_session() noexcept;
  bool accept(const transport::Received&, std::span<std::byte> bytes) noexcept;
  bool take_contacts(std::span<const std::byte> payload, std::int64_t arrival_ns) noexcept;
  void answer_challenge(std::span<const std::byte> challenge) noexcept;
  bool send_sealed(std::span<const std::byte> datagram) noexcept;
  void publish(std::int64_t now_ns) noexcept;

  transport::UdpSocket socket_;
  const transport::WakeEvent& for_io_;
  realtime::LatestValue<Session> session_;
  realtime::LatestValue<transport::Address> path_;  // port 0: the socket is connected
  std::atomic<std::int64_t> heard_ns_{0}, used_ns_{0};
  realtime::SpscQueue<transport::LaneKeys> keys_{8};
  realtime::SpscQueue<transport::RawDatagram> handshakes_{8};
  realtime::SpscQueue<motion::ObjectCourse> courses_{64};
  realtime::LatestValue<Counters> published_counters_;
  realtime::LatestValue<Meters> published_meters_;

  // The haptic thread's own.
  bool wants_curvature_ = false;
  std::uint32_t ahead_us_ = 0;
  std::uint32_t live_ = 0;
  transport::SealedLane lane_{transport::SealedLane::Role::kInitiator};
  Counters counters_;
  codecs::PoseWriter poses_;
  codecs::AnswerReader answers_;
  std::int64_t next_pose_ns_ = 0;  // poses are no denser than kPosePeriod_ns on average
  codecs::AnswerMessage newest_;
  bool has_newest_ = false;  // of this session
  std::int64_t newest_arrival_ns_ = 0;
  double round_trip_ms_;
  Meters meters_;
  std::int64_t published_ns_ = 0;
};

}  // namespace farfeel::master_station
