#include "master_station/feed/shown_tiles.h"

#include "master_station/feed/tile_patches.h"

namespace farfeel::master_station {

ShownTiles::ShownTiles(const local_model::TileCache* cache) : cache_(cache) {
  if (cache == nullptr) return;
  const auto& bodies = cache->scene().bodies;
  std::size_t all_pieces = 0;
  for (std::uint32_t surface = 0; surface < bodies.size(); ++surface) {
    const std::vector<TilePatch> patches = tile_patches(bodies[surface].surface);
    geometry::Box box;
    std::size_t pieces = 0;
    for (const TilePatch& patch : patches) {
      pieces += patch.triangles_O.size();
      for (const auto& triangle : patch.triangles_O)
        for (const glm::dvec3& corner : triangle) box.include(corner);
    }
    if (patches.empty() || tiles_.size() + patches.size() > codecs::kMostViewTiles ||
        all_pieces + pieces > codecs::kMostViewPieces)
      continue;
    all_pieces += pieces;
    codecs::ViewTiles shown{static_cast<std::uint16_t>(surface), codecs::ViewBox::around(box), 0, {}};
    shown.pieces.reserve(pieces);
    for (const TilePatch& patch : patches) {
      for (const auto& [a, b, c] : patch.triangles_O)
        shown.pieces.push_back({{shown.box.vertex(a), shown.box.vertex(b), shown.box.vertex(c)}, shown.tiles});
      ++shown.tiles;
      tiles_.push_back({surface, patch.tile});
    }
    where_.push_back(std::move(shown));
  }
}

codecs::ViewPresence ShownTiles::presence() const {
  codecs::ViewPresence presence;
  presence.is_here.reserve(tiles_.size());
  for (const contact_service::SurfaceTile& tile : tiles_) presence.is_here.push_back(cache_->given(tile).has_value());
  return presence;
}

}  // namespace farfeel::master_station
