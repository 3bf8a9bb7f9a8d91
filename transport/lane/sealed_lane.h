// A lane's datagrams, sealed and opened: the keys in use, their counters and their windows.
//
// Up to three handshakes' keys live side by side, so that a new one breaks nothing: the initiator sends with new keys
// at once; the responder when the first datagram with them has come, which proves that the initiator has them too. A
// datagram is taken in this order: its size, its index, the tag, and only then the window.
//
// For the one thread that owns the lane's socket. Nothing here allocates, locks, throws or reads a clock.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "transport/lane/lane_keys.h"
#include "transport/lane/replay_window.h"

namespace farfeel::transport {

/// Datagrams that changed nothing, by the first reason found.
struct LaneRejects {
  std::uint64_t malformed = 0;      ///< no data datagram, or of a size that none has
  std::uint64_t unknown_index = 0;  ///< of keys that are not, or not any more, in use here
  std::uint64_t forged = 0;         ///< the tag is wrong

  friend bool operator==(const LaneRejects&, const LaneRejects&) = default;
};

class SealedLane {
 public:
  enum class Role : std::uint8_t { kInitiator, kResponder };
  explicit SealedLane(Role role) noexcept : role_(role) {}

  /// A handshake is finished. Ignored if its generation is not newer than all before.
  void adopt(const LaneKeys&) noexcept;
  [[nodiscard]] std::uint64_t newest_generation() const noexcept { return newest_adopted_; }
  /// Drops all keys; counters go on.
  void forget() noexcept;

  /// Whether seal() has keys to seal with, whose counters are not used up.
  [[nodiscard]] bool can_send(std::int64_t now_ns) const noexcept;
  /// Of the keys that seal() uses; 0 without any.
  [[nodiscard]] std::uint64_t sending_generation() const noexcept;

  /// Writes the datagram of one message and returns its size, or 0: it cannot send, or it does not fit. The message may
  /// stand at to[kDataHeaderBytes + 1] already.
  [[nodiscard]] std::size_t seal(std::uint8_t type, std::span<const std::byte> message, std::span<std::byte> to,
                                 std::int64_t now_ns) noexcept;

  /// Leaves out the counters below this one of the keys that seal() uses; never goes back. Tests see the last ones so.
  void skip_to(std::uint64_t counter) noexcept;

  struct Opened {
    std::uint8_t type = 0;
    std::span<const std::byte> message;  ///< into the datagram, which is opened in place
    bool is_newest = false;              ///< newer than all before, of any keys; else it is late
    std::uint64_t generation = 0;        ///< of the keys
    std::uint32_t session = 0;
    /// The type's byte and the message, which stands behind it.
    [[nodiscard]] std::span<const std::byte> plain() const { return {message.data() - 1, message.size() + 1}; }
  };
  /// The message of an authentic datagram that was not seen before; nothing otherwise.
  [[nodiscard]] std::optional<Opened> open(std::span<std::byte> datagram, std::int64_t now_ns) noexcept;

  /// Whether a datagram names keys in use here, before anything is opened: cheap.
  [[nodiscard]] bool knows(std::span<const std::byte> datagram) const noexcept;

  /// Received, lost, late, duplicate of all keys so far, and how many were sealed.
  [[nodiscard]] LaneCounters counters() const noexcept;
  [[nodiscard]] const LaneRejects& rejects() const noexcept { return rejects_; }

 private:
  struct Keys {
    explicit Keys(const LaneKeys& of) : keys(of), send(of.suite, of.send), receive(of.suite, of.receive) {}
    LaneKeys keys;
    SealKey send, receive;
    ReplayWindow window;
    std::uint64_t next_counter = 0;
  };
  enum Place : std::size_t { kCurrent, kPrevious, kNext, kPlaces };
  void retire(Place) noexcept;
  void become_current(Place) noexcept;

  Role role_;
  std::array<std::optional<Keys>, kPlaces> keys_;
  std::uint64_t newest_adopted_ = 0;  // generation
  std::uint64_t newest_heard_ = 0;    // generation
  LaneCounters retired_;              // of keys that are gone
  LaneRejects rejects_;
  std::uint64_t sealed_ = 0;
  std::uint64_t forks_ = 0;  // of this process when the keys came: a child must not seal with its parent's
};

/// The receiver's index of a data datagram; 0 if it is none.
[[nodiscard]] std::uint32_t receiver_index(std::span<const std::byte> datagram) noexcept;

}  // namespace farfeel::transport
