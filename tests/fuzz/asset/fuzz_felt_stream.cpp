// Any bytes as a felt stream, after seven counts of two bytes each: refused, or read into something that can be told
// again, if it has no faults. What follows from a detail does or is refused.
#include <cstdlib>
#include <cstring>

#include "codecs/asset/felt_stream.h"
#include "codecs/asset/followed_heights.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace farfeel;
  std::array<std::uint16_t, 7> counts{};
  if (size < sizeof counts) return 0;
  std::memcpy(counts.data(), data, sizeof counts);
  const codecs::FeltCounts of{counts[0], counts[1], counts[2], counts[3], counts[4], counts[5], counts[6]};
  codecs::FeltDetail detail{.mesh = {}, .reach_m = 0.01, .texel_m = 1e-3};
  auto surface = codecs::decoded_felt(std::as_bytes(std::span(data, size)).subspan(sizeof counts), of, &detail.mesh);
  if (!surface) return 0;
  if (!detail.mesh.triangles.empty() && !codecs::follow(*surface, of.charts, detail)) return 0;
  if (!geometry::faults(*surface).empty()) return 0;
  if (!codecs::can_be_told(*surface)) std::abort();
  if (!codecs::decoded_felt(codecs::encoded_felt(*surface, detail.mesh), codecs::counts_of(*surface, detail.mesh)))
    std::abort();
  (void)codecs::encoded_felt(codecs::stored_order(*surface));
  return 0;
}
