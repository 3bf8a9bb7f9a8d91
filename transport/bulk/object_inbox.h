// The objects that a peer sends: offers in, answers out, pieces in, whole objects out. Time is an argument; one thread.
//
// Memory is reserved from the peer's and the scene's budget before it is allocated, is not written to before bytes
// arrive for it, and stays reserved until the last owner of the object lets go of it. What does not fit is refused, and
// the answer says why. The hash is computed as the object's beginning grows, a bounded part at a time.
//
// Of the offers in one slot the greatest id counts: older ones, however late, change nothing. After restart() what has
// arrived is kept, by hash and size, and an offer of the same goes on from there, until its room is needed.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "transport/bulk/bulk_messages.h"
#include "transport/bulk/byte_budget.h"
#include "transport/bulk/granule_map.h"
#include "transport/bulk/object_hasher.h"

namespace farfeel::transport {

/// Bytes of an object that arrived, in memory that was never zeroed. Immutable once it is delivered.
class ObjectBytes {
 public:
  ObjectBytes(std::size_t size, ByteReservation reservation)
      : bytes_(std::make_unique_for_overwrite<std::byte[]>(size)), size_(size), reservation_(std::move(reservation)) {}
  [[nodiscard]] std::span<const std::byte> bytes() const { return {bytes_.get(), size_}; }
  [[nodiscard]] std::span<std::byte> bytes() { return {bytes_.get(), size_}; }

 private:
  std::unique_ptr<std::byte[]> bytes_;
  std::size_t size_;
  ByteReservation reservation_;
};

struct ReceivedObject {
  std::uint32_t slot = 0;
  ObjectHash hash{};  ///< checked
  std::shared_ptr<const ObjectBytes> object;
};

struct InboxLimits {
  std::uint64_t object_bytes = kMaxObjectBytes;    ///< of one
  std::uint64_t peer_bytes = 2 * kMaxObjectBytes;  ///< of all that this peer's objects hold
  std::size_t transfers = 16;                      ///< at once
  std::size_t slots = 256;                         ///< in a session
  std::uint8_t rounds = 3;                         ///< so often an object may fail its hash
  std::uint32_t first_slot = 0;                    ///< what stands in one before it is refused
};

class ObjectInbox {
 public:
  struct Counters {
    std::uint64_t delivered = 0, corrupt = 0, refused = 0, superseded = 0, resumed = 0, repeated_bytes = 0;
  };

  /// scene: what all peers of a scene share.
  ObjectInbox(const InboxLimits&, std::shared_ptr<ByteBudget> scene);

  void on_offer(const ObjectOffer&);
  void on_withdrawal(const ObjectWithdrawal&);
  /// What fits no transfer changes nothing.
  void on_piece(const ObjectPiece&);
  /// The next answer that is to be sent; each is given out once, for the offer is said again if it gets lost.
  [[nodiscard]] std::optional<ObjectAnswer> take_answer();
  /// An object whose hash is right, each once. A slot's newest object is delivered again only after another one was.
  [[nodiscard]] std::optional<ReceivedObject> take_object();
  /// Hashes on, where that lags behind what has arrived. True while there is more to do.
  bool work();
  /// A new session of this peer: ids begin anew.
  void restart();

  [[nodiscard]] bool has_answers() const { return !to_answer_.empty(); }
  [[nodiscard]] bool has_work() const;
  /// Whether this session's newest offer in the slot is of the object that was last delivered there.
  [[nodiscard]] bool is_here(std::uint32_t slot) const;
  [[nodiscard]] bool has_objects() const { return !ready_.empty(); }
  /// Of what is being received: bytes that are here, and bytes in all.
  struct Progress {
    std::uint64_t here = 0, all = 0;
  };
  [[nodiscard]] Progress progress() const;
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  struct Transfer {
    ObjectOffer offer;
    bool is_orphan = false;  // of an earlier session, and not offered in this one
    std::uint8_t round = 0;
    std::shared_ptr<ObjectBytes> object;
    GranuleMap has;
    std::uint32_t complete = 0;  // all granules below are here
    ObjectHasher hasher;
    std::size_t hashed = 0;  // bytes
  };
  struct Slot {
    std::uint32_t newest_id = 0;
    std::uint16_t ask = 0;
    ObjectState state{};
    RefusedBecause reason{};
    std::optional<ObjectHash> delivered;  // the last one, in any session
  };
  [[nodiscard]] Transfer* find(std::uint32_t id);
  void answer(std::uint32_t id, std::uint32_t slot);
  void settle(Slot&, ObjectState, RefusedBecause = RefusedBecause::kNothing);
  [[nodiscard]] RefusedBecause begin(const ObjectOffer&);
  bool hash_on(Transfer&);
  void finish(std::uint32_t id);

  InboxLimits limits_;
  std::shared_ptr<ByteBudget> peer_, scene_;
  std::vector<std::unique_ptr<Transfer>> transfers_;
  std::map<std::uint32_t, Slot> slots_;
  struct ToAnswer {
    std::uint32_t id, slot;
    bool is_withdrawn;
  };
  std::deque<ToAnswer> to_answer_;
  std::deque<ReceivedObject> ready_;
  std::uint32_t revision_ = 0;
  Counters counters_;
};

}  // namespace farfeel::transport
