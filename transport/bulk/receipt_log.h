// Which numbered messages have arrived, and the receipts that say so. Time is an argument; one thread; memory is fixed.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "transport/bulk/bulk_messages.h"
#include "transport/bulk/bulk_source.h"

namespace farfeel::transport {

class ReceiptLog {
 public:
  /// Takes the head of a message that arrived at arrival_ns; false if it had arrived before.
  bool note(const BulkHead&, std::int64_t arrival_ns);
  /// The receipt that is due, if one is. The first message after a pause is acknowledged at once; later ones share
  /// receipts, which leave as far apart as the sender asks for.
  [[nodiscard]] std::optional<Receipt> take_due(std::int64_t now_ns);
  [[nodiscard]] std::int64_t next_time_ns() const;
  /// A new session: nothing has arrived.
  void restart() { *this = {}; }

 private:
  struct Range {
    std::uint64_t begin = 0, end = 0;  // numbers [begin, end)
  };
  struct Arrival {
    std::uint64_t number = 0;
    std::int64_t arrival_ns = 0;
  };
  [[nodiscard]] bool insert(std::uint64_t number);

  // Newest first, apart. Where there are more, the oldest are forgotten: by then they were in many receipts.
  std::array<Range, Receipt::kMostRanges> ranges_{};
  std::size_t range_count_ = 0;
  std::uint64_t forgotten_ = 0;                           // nothing below is known
  std::array<Arrival, Receipt::kMostStamps> arrivals_{};  // since the last receipt, the newest of them
  std::uint64_t arrival_count_ = 0;
  std::uint64_t newest_ = 0;
  std::int64_t newest_arrival_ns_ = 0;
  std::uint32_t newest_t_send_us_ = 0;
  std::int64_t spacing_ns_ = 0;
  std::int64_t reported_ns_ = 0;  // when the last receipt left
  bool has_any_ = false;
};

/// The number of 64 bits with these low 32 that lies nearest to `near`.
[[nodiscard]] constexpr std::uint64_t widened(std::uint32_t low, std::uint64_t near) {
  return near + static_cast<std::uint64_t>(
                    static_cast<std::int64_t>(static_cast<std::int32_t>(low - static_cast<std::uint32_t>(near))));
}

}  // namespace farfeel::transport
