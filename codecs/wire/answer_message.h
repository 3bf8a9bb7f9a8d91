// The contacts at a pose, down: 35 bytes and 36 a contact. transport/PROTOCOL.md has the table.
//
// Geometry is told anew each time, relative to the tool: the newest wins. What seldom changes of a contact, its id, its
// object and its material, is told until the master has acknowledged an answer that held it, and is a place in a table
// from then on:
//
//   slave     place 3 := (id 71, object 0, material) in answers 900, 901, ... 917, while 3 is not acknowledged
//   master    pose: heard 902           it has read answer 902, so it has what 902 tells of place 3
//   slave     place 3 in answer 918, ...
//
// Contacts of one object are mostly of one material: where the master has that of another place already, a new contact
// is told as that place's but for its id.
//
// A place that is given to another contact is told again until it is acknowledged again, by an answer that was written
// after. The master reads no answer that is older than one that it has read, so it never holds what comes later than
// what it reads: whatever is lost, late, twice or out of order, an answer is read as it was meant, or is refused.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "codecs/wire/haptic_limits.h"
#include "codecs/wire/pose_grid.h"
#include "codecs/wire/pose_message.h"
#include "haptic_core/contact/contact_set.h"
#include "haptic_core/teleoperation/controller.h"

namespace farfeel::codecs {

inline constexpr std::size_t kAnswerBlockBytes = 35;  ///< without what is optional
inline constexpr std::size_t kContactBytes = 36;      ///< of a contact whose place is acknowledged
inline constexpr std::size_t kShareBytes = 2, kLikeBytes = 5, kIdentityBytes = 25, kCurvedBytes = 63;
inline constexpr std::size_t kPlaces = 64;  ///< twice the contacts of an answer: one that comes back is still known
/// Answers of which the slave remembers what they told: 2 s at 1 kHz. An older one's acknowledgement is nothing to it.
inline constexpr std::uint32_t kAnswersRemembered = 2048;

struct AnswerMessage {
  std::uint32_t number = 0;  ///< of the message; AnswerWriter counts, from 1 on
  /// pose_sequence is PoseMessage::number at the slave, PoseMessage::sequence at the master. pose_time_ns is not told:
  /// the master knows it.
  contact::ContactSet set;
  LaneTimes times;
  std::uint16_t left_out = 0;  ///< contacts that did not fit: always the shallowest, or furthest apart
  std::optional<teleoperation::LineValue> line = {};  ///< where the slave simulates the tool, whose pose the set's is
};

// Of AnswerMessage's first byte; the lowest two bits are how the pose is told.
inline constexpr std::uint8_t kPoseAsAsked = 0, kPoseOnGrid = 1, kPoseInFull = 2, kPoseMask = 3;
inline constexpr std::uint8_t kPointsInFull = 1 << 2, kAreCurved = 1 << 3, kHasLine = 1 << 4;
// Of a contact's first byte; the other bits are its place.
inline constexpr std::uint8_t kHasShare = 1 << 6, kHasIdentity = 1 << 7;
// An identity's first byte: the place that it is like but for the id, or this.
inline constexpr std::uint8_t kLikeNone = 0xFF;

/// What is told once. Singles, as they go over the wire.
struct ContactIdentity {
  std::uint32_t id = 0, object = 0;
  float stiffness_N_per_m = 0, damping_Ns_per_m = 0, static_friction = 0, dynamic_friction = 0;
  /// The same but for the id.
  [[nodiscard]] bool is_like(const ContactIdentity& other) const {
    ContactIdentity renamed = other;
    renamed.id = id;
    return *this == renamed;
  }
  friend bool operator==(const ContactIdentity&, const ContactIdentity&) = default;
};

/// The slave's end. One thread, realtime-safe.
class AnswerWriter {
 public:
  AnswerWriter() { reset({}); }

  /// A session begins: its master knows of nothing.
  void reset(const PoseGrid& grid) noexcept;
  /// PoseMessage::heard of a pose that came, in any order and any number of times. Nothing: the master has heard
  /// nothing of late, and is told everything.
  void acknowledge(std::optional<std::uint16_t> heard) noexcept;
  /// Gives the answer the next number. `asked` is X_WT of the pose message that set.pose_sequence is the number of.
  /// The deepest contacts are kept if not all fit, in the set's order; `left_out` of the argument is not looked at.
  /// Returns the bytes written, 0 if not even the block fits.
  [[nodiscard]] std::size_t write(const AnswerMessage&, const spatial::Pose& asked, std::span<std::byte> to) noexcept;
  [[nodiscard]] std::uint32_t number() const noexcept { return number_; }  ///< of the newest; 0 before any
  /// Contacts of the newest that did not fit.
  [[nodiscard]] std::uint32_t left_out() const noexcept { return left_out_; }

 private:
  struct Place {
    ContactIdentity identity;
    bool is_given = false, is_acknowledged = false;
    std::uint32_t given_at = 0;  // the first answer that told this identity
    std::uint32_t used_at = 0;   // the newest that held the contact
    float last_stiffness_N_per_m = 0;
  };
  /// How a contact is told.
  struct Entry {
    std::size_t place = kPlaces;   // kPlaces: it has none yet
    bool is_new = true;            // its identity is not the place's: it becomes that
    bool is_told = true;           // with its identity
    std::uint16_t share = kWhole;  // of the identity's stiffness and damping, a half
    ContactIdentity identity;      // the place's from now on
    std::size_t like = kPlaces;    // an acknowledged place that the identity is like
  };
  static constexpr std::uint16_t kWhole = 0x3C00;  // 1
  [[nodiscard]] Entry entry_of(const contact::Contact&, std::uint64_t taken) const noexcept;
  [[nodiscard]] std::size_t free_place(std::uint64_t taken) const noexcept;
  using Entries = std::array<Entry, contact::kMaxContacts>;
  using Going = std::array<bool, contact::kMaxContacts>;
  void liken(Entry&, std::uint64_t acknowledged) const noexcept;
  [[nodiscard]] static std::size_t told_before(const Entries&, const Going&, std::size_t i) noexcept;
  [[nodiscard]] static std::size_t identity_bytes(const Entries&, const Going&, std::size_t i) noexcept;

  PoseGrid grid_;
  std::uint32_t number_ = 0, number_at_reset_ = 0, left_out_ = 0;
  std::array<Place, kPlaces> places_{};
  std::array<std::uint64_t, kAnswersRemembered> held_{};  // which places an answer held, at number % kAnswersRemembered
};

/// The master's end. One thread, realtime-safe.
class AnswerReader {
 public:
  /// A session begins: nothing is known.
  void reset() noexcept;
  /// Exact length, finite, within range, newer than what was read before, about a pose that was sent, and of contacts
  /// that are known or told; otherwise out is left as it was, and so is the table. pose_sequence, pose_time_ns, X_WT
  /// are filled in from what was sent.
  [[nodiscard]] Fault read(std::span<const std::byte> message, const PoseWriter& sent, AnswerMessage& out) noexcept;
  /// For the next pose message: the low half of the newest answer's number. Nothing before any, and where its pose is
  /// forgotten by now: 65536 answers later that half would be another's.
  [[nodiscard]] std::optional<std::uint16_t> heard(const PoseWriter& sent) const noexcept {
    if (!has_read_ || !sent.find(newest_pose_)) return std::nullopt;
    return static_cast<std::uint16_t>(newest_);
  }

 private:
  [[nodiscard]] Fault read_at_hand(CheckedReader&, const PoseWriter& sent) noexcept;
  [[nodiscard]] ContactIdentity read_identity(CheckedReader&) const noexcept;
  void read_contact(CheckedReader&, std::uint8_t flags, const PoseGrid&, contact::Contact&) noexcept;

  struct Known {
    ContactIdentity identity;
    bool is_known = false;
  };
  bool has_read_ = false;
  std::uint32_t newest_ = 0, newest_pose_ = 0;    // numbers of the newest answer and of its pose
  std::array<Known, kPlaces> places_{}, next_{};  // next_: with what the message at hand tells
  std::uint64_t taken_ = 0;                       // places of the message at hand
  std::uint32_t pose_at_hand_ = 0;
  AnswerMessage at_hand_;
};

}  // namespace farfeel::codecs
