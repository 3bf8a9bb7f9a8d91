// Any bytes as a part of a tile: refused with a word, or rows that a tile has.
#include <cstdlib>

#include "codecs/tile/tile_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto part = farfeel::codecs::decoded_tile_part(std::as_bytes(std::span(data, size)));
  if (!part) return 0;
  if (part->coefficients.size() != part->rows * farfeel::geometry::kTileSide) std::abort();
  farfeel::codecs::TileAssembly assembly;
  (void)assembly.add(*part);
  return 0;
}
