// Any bytes as a message of the bulk lane: refused, or written again as they were.

#include <algorithm>
#include <cstdlib>

#include "transport/bulk/bulk_messages.h"

using namespace farfeel::transport;

namespace {

template <typename Message>
void expect_same(const std::optional<Message>& message, std::span<const std::byte> from) {
  if (!message) return;
  MessageBuffer to;
  const auto written = write(*message, to);
  if (!std::equal(written.begin(), written.end(), from.begin(), from.end())) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto from = std::as_bytes(std::span(data, size));
  if (size <= kMostMessageBytes) {
    if (const auto head = read_bulk_head(from)) {
      expect_same(head, from.first(BulkHead::kBytes));
      expect_same(read_object_piece(from.subspan(BulkHead::kBytes)), from.subspan(BulkHead::kBytes));
    }
  }
  expect_same(read_receipt(from), from);
  expect_same(read_object_offer(from), from);
  expect_same(read_object_answer(from), from);
  expect_same(read_object_withdrawal(from), from);
  return 0;
}
