// A way to carry many bytes from the slave to the master, for `farfeel-bench bulk`.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "tests/bench/two_ends.h"

namespace farfeel::bench {

/// Transfers from when it is made until it ends, in threads of its own.
class BulkTransfer {
 public:
  virtual ~BulkTransfer() = default;
  /// Bytes of content that have arrived so far, each once.
  [[nodiscard]] virtual std::uint64_t arrived_bytes() const = 0;
};

using MadeTransfer = tl::expected<std::unique_ptr<BulkTransfer>, std::string>;  ///< or why it cannot be had

/// Objects on a sealed bulk lane, which knows what the haptic lane beside it sends.
[[nodiscard]] MadeTransfer begin_bulk_lane(const TwoEnds&, const std::atomic<std::uint64_t>& haptic_bytes);
/// The kernel's TCP with that congestion control: "cubic", "bbr".
[[nodiscard]] MadeTransfer begin_tcp(const TwoEnds&, const std::string& congestion_control);

/// Of a transfer's threads: below the haptic lane's, above other work of this machine, which is not what is measured.
inline constexpr int kBulkFifoPriority = 30;

}  // namespace farfeel::bench
