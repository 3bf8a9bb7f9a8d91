// Everything that is known of a link at one end, at one moment: what `farfeel link-status` shows. Plain values, of
// lanes over the program's life at the master, and over the live session at the slave, where masters come and go.
//
// Up is from the master to the slave. Times are in ms, NaN where nothing has been measured.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace farfeel::transport {

inline constexpr double kUnmeasured = std::numeric_limits<double>::quiet_NaN();

struct DelayStatus {
  double p50_ms = kUnmeasured, p99_ms = kUnmeasured, most_ms = kUnmeasured;
  std::uint64_t samples = 0;
  double least_ms = kUnmeasured;
};

/// One direction of a lane. What an end cannot know of the other's is 0.
struct DirectionStatus {
  std::uint64_t sent = 0, arrived = 0;                    ///< datagrams
  std::uint64_t sent_bytes = 0, arrived_bytes = 0;        ///< UDP payloads; what a slave sent, with IP and UDP headers
  std::uint64_t lost = 0, bursts = 0, longest_burst = 0;  ///< datagrams; runs of lost ones; the longest of those
  std::uint64_t late = 0, duplicate = 0;                  ///< came after a newer one; came again
  std::uint64_t malformed = 0, unknown_keys = 0, forged = 0, unusable = 0;  ///< rejected; unusable: authentic
  std::uint64_t congestion_marks = 0;                                       ///< ECN: CE
  int dscp = -1;                   ///< of the newest that arrived; -1: not told
  DelayStatus one_way_excess;      ///< above the least of the last 2 s: the two clocks need not agree
  double jitter_ms = kUnmeasured;  ///< RFC 3550, 6.4.1
};

struct LaneStatus {
  bool is_used = false;
  double silent_ms = kUnmeasured;  ///< since anything authentic arrived
  DelayStatus round_trip;          ///< of the network, and of `peer_waiting`
  /// Of it, in the peer's socket and for its thread, before the peer computes; what that takes is no part of either.
  DelayStatus peer_waiting;
  DirectionStatus up, down;
  std::uint64_t rekeys = 0;         ///< handshakes that gave keys
  std::uint64_t migrations = 0;     ///< the peer's, or this machine's, changes of address
  std::uint64_t longest_bytes = 0;  ///< of the datagrams that arrived; 0: not told
};

/// What the bulk lane has beside.
struct BulkStatus {
  double least_round_trip_ms = kUnmeasured;
  double delivered_mbit = kUnmeasured;  ///< delivered when it last had all that there was
  double queue_ms = kUnmeasured;        ///< that its own datagrams make
  std::uint64_t message_bytes = 0;      ///< longest that this path is known to carry
};

/// Initiations at a slave, by what became of them.
struct HandshakeStatus {
  std::uint64_t initiations = 0, answered = 0, cookies = 0, refused = 0, dropped = 0;
};

struct LinkStatus {
  std::string role;  ///< master or slave
  std::int64_t pid = 0;
  double age_s = 0;     ///< of these figures; set by who reads them
  double uptime_s = 0;  ///< of the program
  std::string local, peer, peer_name, cipher;
  std::string trouble;  ///< empty while all is well
  std::uint64_t sessions = 0;
  LaneStatus haptic, bulk;
  BulkStatus bulk_pace;
  HandshakeStatus handshakes;
};

}  // namespace farfeel::transport
