// Any bytes as the outline of what is felt: refused with a word, or surfaces that contacts can be looked for on.
#include <cstdlib>

#include "codecs/felt/felt_outline.h"
#include "haptic_core/local_model/local_contacts.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace farfeel;
  auto scene = codecs::read_felt_outline(std::as_bytes(std::span(data, size)));
  if (!scene) return scene.error().empty() ? std::abort(), 0 : 0;
  std::size_t tiles = 0, triangles = 0;
  for (const auto& body : scene->bodies)
    tiles += body.surface.tiles.size(), triangles += body.surface.triangle_piece.size();
  if (tiles > 256 || triangles > 256) return 0;  // allowed, but slow to look at
  local_model::TileCache cache(std::move(*scene));
  for (std::uint32_t tile = 0; tile < tiles; ++tile) (void)cache.put({1, tile}, {});
  local_model::LocalContacts contacts(cache);
  (void)contacts.at({});
  return 0;
}
