// What became of a lane's datagrams: received, lost, late, duplicate, told from their sequence numbers.
//
// State travels as "latest wins": only a datagram newer than every one before it is used. The others are counted.
// A datagram counts as lost from the moment a newer one arrives until it comes itself, late; so reordering is not
// mistaken for loss in the end.
#pragma once

#include <bitset>
#include <cstdint>

namespace farfeel::transport {

struct LaneCounters {
  std::uint64_t sent = 0;       ///< by the sending side, if it is known here
  std::uint64_t received = 0;   ///< different datagrams, late ones included
  std::uint64_t lost = 0;       ///< gaps before the newest that are still open
  std::uint64_t late = 0;       ///< came after a newer one
  std::uint64_t duplicate = 0;  ///< came again, or too late to tell

  friend bool operator==(const LaneCounters&, const LaneCounters&) = default;
};
/// Sums over sessions.
[[nodiscard]] LaneCounters operator+(const LaneCounters&, const LaneCounters&) noexcept;

/// One direction of one lane in one session, whose first datagram is number 1. Fixed memory; realtime-safe.
class SequenceWindow {
 public:
  enum class Verdict : std::uint8_t {
    kNewest,     ///< newer than all before: use it
    kLate,       ///< first time seen, but a newer one came before: count, do not use
    kDuplicate,  ///< seen already, or older than the window remembers
    kAbsurd,     ///< 0, or further ahead than any real gap: not counted, nothing changes
  };

  Verdict accept(std::uint32_t sequence) noexcept;
  [[nodiscard]] const LaneCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] std::uint32_t newest() const noexcept { return newest_; }

  static constexpr std::uint32_t kRemembered = 2048;  ///< datagrams behind the newest that late ones are told within
  /// A session is lost after 2 s of silence; at 5 kHz that is 10,000 datagrams.
  static constexpr std::uint32_t kMaxJump = 1u << 16;

 private:
  LaneCounters counters_;
  std::uint32_t newest_ = 0;
  std::bitset<kRemembered> seen_;  ///< bit (sequence % kRemembered), for the kRemembered newest
};

}  // namespace farfeel::transport
