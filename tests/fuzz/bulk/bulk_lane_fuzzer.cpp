// A hostile peer: any messages at any times at a lane that sends objects and takes some. Input: records of a length of
// two bytes, a pause of one [ms], and a message. Memory stays within its budget, and what is delivered has its hash.

#include <algorithm>
#include <cstdlib>

#include "transport/bulk/bulk_lane.h"

using namespace farfeel::transport;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint64_t kBudget = 1u << 20;
  const auto scene = std::make_shared<ByteBudget>(kBudget);
  BulkOptions options;
  options.inbox.peer_bytes = kBudget / 2;
  BulkLane lane(options, scene);
  static const auto object = make_object(std::vector<std::byte>(100'000, std::byte{7}));
  std::int64_t now_ns = 1'000'000'000;
  lane.outbox().offer(1, object, 100, now_ns);
  MessageBuffer out;
  const auto from = std::as_bytes(std::span(data, size));
  for (std::size_t at = 0; at + 3 <= size;) {
    const std::size_t length = std::min<std::size_t>(data[at] + 256u * data[at + 1], size - at - 3);
    now_ns += data[at + 2] * 1'000'000;
    (void)lane.on_message(from.subspan(at + 3, length), now_ns);
    at += 3 + length;
    for (int i = 0; i < 50; ++i) {
      const std::size_t bytes = lane.next(out, now_ns);
      if (bytes == 0) break;
      if (bytes > kMostMessageBytes) std::abort();
    }
    if (lane.next_time_ns(now_ns) < now_ns) std::abort();
    while (const auto received = lane.inbox().take_object())
      if (hash_of(received->object->bytes()) != received->hash) std::abort();
    if (lane.inbox().progress().all > kBudget / 2 || scene->free_bytes() > kBudget) std::abort();
  }
  return 0;
}
