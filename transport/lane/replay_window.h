// Which of a key's counters have been seen, and what became of a lane's datagrams: received, lost, late, duplicate.
//
// State travels as "latest wins": only a datagram newer than every one before it is used, the others are counted. A
// datagram counts as lost from the moment a newer one arrives until it comes itself, late; so reordering is not
// mistaken for loss in the end. After RFC 6479, with counters that may be as large as 2^64 - 1 and gaps of any length.
#pragma once

#include <bitset>
#include <cstdint>

namespace farfeel::transport {

struct LaneCounters {
  std::uint64_t sent = 0;                       ///< by the sending side, if it is known here
  std::uint64_t received = 0;                   ///< different datagrams, late ones included
  std::uint64_t lost = 0;                       ///< gaps before the newest that are still open
  std::uint64_t late = 0;                       ///< came after a newer one
  std::uint64_t duplicate = 0;                  ///< came again, or too late to tell
  std::uint64_t bursts = 0, longest_burst = 0;  ///< gaps when a newer one came, whatever came late; the longest of them

  friend bool operator==(const LaneCounters&, const LaneCounters&) = default;
};
/// Sums over keys and sessions.
[[nodiscard]] LaneCounters operator+(const LaneCounters&, const LaneCounters&) noexcept;

/// One direction of one key. Fixed memory; realtime-safe. Ask only after a datagram was opened: a forged counter must
/// not move the window.
class ReplayWindow {
 public:
  enum class Verdict : std::uint8_t {
    kNewest,     ///< newer than all before: use it
    kLate,       ///< first time seen, but a newer one came before
    kDuplicate,  ///< seen already, or older than the window remembers
  };

  Verdict accept(std::uint64_t counter) noexcept;
  [[nodiscard]] const LaneCounters& counters() const noexcept { return counters_; }

  static constexpr std::uint64_t kRemembered = 2048;  ///< counters behind the newest that late ones are told within

 private:
  LaneCounters counters_;
  bool has_any_ = false;
  std::uint64_t newest_ = 0;
  std::bitset<kRemembered> seen_;  ///< bit (counter % kRemembered), for the kRemembered newest
};

}  // namespace farfeel::transport
