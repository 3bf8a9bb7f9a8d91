// Any bytes as a felt stream, after five counts of two bytes each: refused, or read into something that can be told
// again, if it has no faults.
#include <cstdlib>
#include <cstring>

#include "codecs/asset/felt_stream.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace farfeel;
  std::array<std::uint16_t, 5> counts{};
  if (size < sizeof counts) return 0;
  std::memcpy(counts.data(), data, sizeof counts);
  const codecs::FeltCounts of{counts[0], counts[1], counts[2], counts[3], counts[4]};
  const auto surface = codecs::decoded_felt(std::as_bytes(std::span(data, size)).subspan(sizeof counts), of);
  if (!surface || !geometry::faults(*surface).empty()) return 0;
  if (!codecs::can_be_told(*surface)) std::abort();
  if (!codecs::decoded_felt(codecs::encoded_felt(*surface), of)) std::abort();
  (void)codecs::encoded_felt(codecs::stored_order(*surface));
  return 0;
}
