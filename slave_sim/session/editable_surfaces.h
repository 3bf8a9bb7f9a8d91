// Surfaces that change while they are touched: whoever looks at some keeps them here, and takes edits over between two
// looks. Nobody shares: each thread of a session has its own.
#pragma once

#include <vector>

#include "haptic_core/contact/touchable.h"
#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/penetration/felt_surface.h"
#include "slave_sim/edits/stamp.h"

namespace farfeel::slave_sim {

class EditableSurfaces {
 public:
  /// The tool's surface first, then the objects'. felt was made from it; both must outlive this.
  void add(geometry::HapticSurface& surface, penetration::FeltSurface& felt) { all_.push_back({&surface, &felt}); }
  /// Whether the edit was newer, of a tile that there is. Realtime-safe.
  bool apply(const SurfaceEdit& edit) noexcept {
    if (edit.where.surface >= all_.size()) return false;
    auto& [surface, felt] = all_[edit.where.surface];
    if (edit.where.tile >= surface->tiles.size()) return false;
    geometry::HeightTile& tile = surface->tiles[edit.where.tile];
    if (edit.tile.version <= tile.version) return false;
    tile = edit.tile;
    felt->take_tile(edit.where.tile);
    return true;
  }

 private:
  struct One {
    geometry::HapticSurface* surface;
    penetration::FeltSurface* felt;
  };
  std::vector<One> all_;
};

}  // namespace farfeel::slave_sim
