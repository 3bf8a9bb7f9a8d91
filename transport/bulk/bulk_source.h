// What has something to send on the bulk lane: the objects, and whatever else shares their pacer, such as height tiles.
// One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "transport/bulk/bulk_messages.h"

namespace farfeel::transport {

/// Never: nothing will be due by itself.
inline constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();

class BulkSource {
 public:
  /// One message's body. The tag is the source's own, and comes back once its datagram's fate is known.
  struct Item {
    BulkType type{};  ///< a numbered one
    std::size_t bytes = 0;
    std::uint64_t tag = 0;
  };

  virtual ~BulkSource() = default;
  /// How urgent the next message is, 0 most; nothing while there is none. Of several sources the most urgent one goes
  /// first, and among equals the one that was added first.
  [[nodiscard]] virtual std::optional<std::uint8_t> urgency(std::int64_t now_ns) = 0;
  /// Writes the next message's body, no longer than `to`. Called only after urgency() had something; may still decline.
  [[nodiscard]] virtual std::optional<Item> next(std::span<std::byte> to, std::int64_t now_ns) = 0;
  /// The datagram with that tag has arrived. May come after on_lost(), when it was only late.
  virtual void on_arrived(std::uint64_t tag, std::int64_t now_ns) = 0;
  /// It is taken for lost: what it carried may be sent again, under a tag of its own.
  virtual void on_lost(std::uint64_t tag, std::int64_t now_ns) = 0;
  /// When urgency() may change by itself.
  [[nodiscard]] virtual std::int64_t next_time_ns(std::int64_t now_ns) const {
    (void)now_ns;
    return kNever_ns;
  }
};

}  // namespace farfeel::transport
