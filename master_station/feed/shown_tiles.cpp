#include "master_station/feed/shown_tiles.h"

#include "master_station/feed/tile_patches.h"

namespace farfeel::master_station {

ShownTiles::ShownTiles(const local_model::TileCache* cache) : cache_(cache) {
  if (cache == nullptr) return;
  const auto& bodies = cache->scene().bodies;
  for (std::uint32_t surface = 0; surface < bodies.size(); ++surface) {
    const std::vector<TilePatch> patches = tile_patches(bodies[surface].surface);
    if (patches.empty() || tiles_.size() + patches.size() > codecs::kMostViewTiles) continue;
    geometry::Box box;
    for (const TilePatch& patch : patches)
      for (const glm::dvec3& corner : patch.corner_O) box.include(corner);
    codecs::ViewTiles shown{static_cast<std::uint16_t>(surface), codecs::ViewBox::around(box), {}};
    for (const TilePatch& patch : patches) {
      codecs::ViewPatch& corners = shown.patches.emplace_back();
      for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = shown.box.vertex(patch.corner_O[i]);
      tiles_.push_back({surface, patch.tile});
    }
    where_.push_back(std::move(shown));
  }
}

codecs::ViewPresence ShownTiles::presence() const {
  codecs::ViewPresence presence;
  presence.is_here.reserve(tiles_.size());
  for (const contact_service::SurfaceTile& tile : tiles_) presence.is_here.push_back(cache_->was_given(tile));
  return presence;
}

}  // namespace farfeel::master_station
