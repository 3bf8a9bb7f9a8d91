// Any bytes as a part of a tile: refused with a word, or rows that a tile has, which can be told exactly.
#include <algorithm>
#include <cstdlib>

#include "codecs/tile/tile_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace farfeel;
  const auto part = codecs::decoded_tile_part(std::as_bytes(std::span(data, size)));
  if (!part) return 0;
  if (part->first_row + part->rows > geometry::kTileSide) std::abort();
  codecs::TileAssembly assembly;
  if (assembly.add(*part) != (part->rows == geometry::kTileSide)) std::abort();
  if (part->rows != geometry::kTileSide) return 0;
  codecs::TileAssembly again;
  for (const auto& bytes : codecs::encoded_tile(part->tile, assembly.tile(), codecs::kExactly)) {
    const auto told = codecs::decoded_tile_part(bytes);
    if (!told) std::abort();
    (void)again.add(*told);
  }
  if (again.tile().coefficients != part->coefficients) std::abort();
  return 0;
}
