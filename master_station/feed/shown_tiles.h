// The height tiles that a live view draws, and which of them are here.
#pragma once

#include <vector>

#include "codecs/view/view_shapes.h"
#include "haptic_core/local_model/tile_cache.h"

namespace farfeel::master_station {

class ShownTiles {
 public:
  /// The cache outlives it; nullptr: nothing is felt from tiles. Before the haptic thread takes any over. A body
  /// whose tiles would be too many together with those before is shown without.
  explicit ShownTiles(const local_model::TileCache* cache);

  /// Once, in the order of presence().
  [[nodiscard]] const std::vector<codecs::ViewTiles>& where() const noexcept { return where_; }
  /// Any thread.
  [[nodiscard]] codecs::ViewPresence presence() const;

 private:
  const local_model::TileCache* cache_;
  std::vector<codecs::ViewTiles> where_;
  std::vector<contact_service::SurfaceTile> tiles_;
};

}  // namespace farfeel::master_station
