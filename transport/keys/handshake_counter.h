// A number that never goes back, for the handshakes of one key: the greater of the wall clock and the last number + 1.
//
// A slave takes an initiation only if its number is greater than the last one of that key. So a recorded initiation is
// worth nothing, and the two ends' clocks need not agree. What must hold is that no number of a key comes twice or
// late, whatever happens here: clocks set back, crashes, power cuts, several programs or a fork with the same key.
//
// The last number stands in a file beside the key, which all programs map and raise by compare-and-swap: they share one
// order, without locks, and a program that dies leaves it right. A power cut may lose what was not on the disk yet, so
// the file also holds a ceiling which is ahead of all numbers and on the disk before the first of them is given. It is
// written once a minute at most. After the machine was started anew, numbers go on above the ceiling.
//
//   64 bytes: "ffcount1", u64 boot (of the machine), u64 last, u64 ceiling, u64 ceiling on disk, zeros. Little-endian.
//
// ONE MACHINE A KEY: two machines that share a folder over a network do not share an order.
// Do not shorten the file while programs run: they would be ended by SIGBUS. Deleting it is safe as long as the clock
// is right. Any thread may call next and keep_ahead, at any time.
#pragma once

#include <cstdint>
#include <string>

#include "transport/keys/error.h"

namespace farfeel::transport {

class HandshakeCounter {
 public:
  /// Opens the file, or makes it; the folder is there and private. boot: a number that differs after each start of the
  /// machine, this machine's unless a test says otherwise.
  [[nodiscard]] static KeysResult<HandshakeCounter> open(const std::string& path);
  [[nodiscard]] static KeysResult<HandshakeCounter> open(const std::string& path, std::uint64_t boot);
  HandshakeCounter(HandshakeCounter&& other) noexcept;
  HandshakeCounter& operator=(HandshakeCounter&&) = delete;
  ~HandshakeCounter();

  /// The next number. wall_clock_ns: since 1970; may be wrong, may go back. Takes well under a microsecond, unless
  /// nobody called keep_ahead for kAhead_ns, or the clock leapt: then it waits for the disk.
  [[nodiscard]] std::uint64_t next(std::int64_t wall_clock_ns) noexcept;
  /// Raises the ceiling ahead of time if it is time to. Call it about once a second, from a thread that may wait for
  /// the disk. False if the disk refused: then numbers are still right unless the power fails and the clock is set
  /// back.
  bool keep_ahead(std::int64_t wall_clock_ns) noexcept;

  /// How far ahead of the numbers the ceiling is raised, and how near they may come before it is raised again.
  static constexpr std::uint64_t kAhead_ns = 120'000'000'000;
  static constexpr std::uint64_t kNear_ns = 60'000'000'000;

 private:
  struct Words;
  explicit HandshakeCounter(Words* words) noexcept : words_(words) {}
  bool raise_ceiling(std::uint64_t to) noexcept;
  Words* words_;
};

}  // namespace farfeel::transport
