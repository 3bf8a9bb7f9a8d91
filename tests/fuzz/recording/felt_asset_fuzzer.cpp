// Any bytes as a felt asset: refused with a word, or surfaces without faults.
#include <cstdlib>

#include "codecs/recording/felt_asset.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace farfeel;
  const auto asset = codecs::read_felt_asset(std::as_bytes(std::span(data, size)));
  if (!asset) return asset.error().empty() ? std::abort(), 0 : 0;
  for (const auto& body : asset->scene.bodies)
    if (!geometry::faults(body.surface).empty()) std::abort();
  return 0;
}
