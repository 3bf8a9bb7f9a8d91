// The objects that this end offers: offers out, answers in, pieces out by priority. Time is an argument; one thread.
//
// An object is in a slot; another one in the same slot supersedes it, and no byte of the older one leaves after that.
// No piece is sent before the receiver has answered and said what it has. When every piece has arrived the offer is
// said again until the receiver says that the object is complete, or what it lacks.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "transport/bulk/bulk_source.h"
#include "transport/bulk/granule_map.h"
#include "transport/bulk/object.h"

namespace farfeel::transport {

class ObjectOutbox final : public BulkSource {
 public:
  enum class Status : std::uint8_t { kNone, kOffered, kSending, kComplete, kRefused };
  struct Counters {
    std::uint64_t sent_bytes = 0, resent_bytes = 0, completed = 0, superseded = 0, restarted = 0;
  };

  /// urgency: as BulkSource has it, 0 most. Saying the same again in the same slot changes nothing but the urgency.
  void offer(std::uint32_t slot, std::shared_ptr<const Object>, std::uint8_t urgency, std::int64_t now_ns);
  void withdraw(std::uint32_t slot, std::int64_t now_ns);
  void on_answer(const ObjectAnswer&, std::int64_t now_ns);
  /// A new session: everything that is not withdrawn is offered anew, complete or not.
  void restart(std::int64_t now_ns);

  /// The next offer or withdrawal that is to be said, if one is due: written into `to`.
  [[nodiscard]] std::span<const std::byte> next_statement(std::span<std::byte> to, std::int64_t round_trip_ns,
                                                          std::int64_t now_ns);
  [[nodiscard]] std::int64_t next_statement_ns() const;

  [[nodiscard]] std::optional<std::uint8_t> urgency(std::int64_t now_ns) override;
  [[nodiscard]] std::optional<Item> next(std::span<std::byte> to, std::int64_t now_ns) override;
  void on_arrived(std::uint64_t tag, std::int64_t now_ns) override;
  void on_lost(std::uint64_t tag, std::int64_t now_ns) override;

  [[nodiscard]] Status status(std::uint32_t slot) const;
  [[nodiscard]] RefusedBecause reason(std::uint32_t slot) const;  ///< of a refusal, else kNothing
  [[nodiscard]] std::size_t transfers() const { return outgoing_.size(); }
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  struct Range {
    std::uint32_t begin = 0, end = 0;
  };
  struct Outgoing {
    std::uint32_t id = 0, slot = 0;
    std::uint8_t urgency = 0;
    std::shared_ptr<const Object> object;
    Status status = Status::kOffered;
    RefusedBecause reason{};
    GranuleMap arrived;
    std::deque<Range> lost;
    std::uint32_t next = 0;       // the first granule never sent, or known to be there
    std::uint32_t in_flight = 0;  // pieces
    std::uint16_t ask = 0;
    bool has_asked_whole = false;  // this ask was made when everything had arrived
    std::uint8_t round = 0;
    std::uint32_t revision = 0;  // of the newest answer
    std::int64_t say_ns = 0, pause_ns = 0;
  };
  struct Withdrawn {
    std::uint32_t id;
    std::int64_t say_ns, pause_ns;
  };
  [[nodiscard]] Outgoing* find(std::uint32_t id);
  [[nodiscard]] const Outgoing* in_slot(std::uint32_t slot) const;
  [[nodiscard]] Outgoing* most_urgent();
  static void start(Outgoing&, std::int64_t now_ns);
  static bool has_piece(Outgoing&);
  static void fill_in(Outgoing&, const ObjectAnswer&);
  void forget_there(std::uint32_t id, std::int64_t now_ns);
  void ask_if_whole(Outgoing&, std::int64_t now_ns);

  std::vector<Outgoing> outgoing_;  // one a slot
  std::vector<Withdrawn> withdrawn_;
  std::uint32_t last_id_ = 0;
  Counters counters_;
};

}  // namespace farfeel::transport
