#include "haptic_core/local_model/tile_cache.h"

#include <algorithm>

#include "haptic_core/local_model/constants.h"

namespace farfeel::local_model {
TileCache::TileCache(contact_service::FeltScene scene) : scene_(std::move(scene)), arrived_(kQueuedTiles) {
  for (contact_service::FeltBody& body : scene_.bodies) {
    is_here_.emplace_back(body.surface.tiles.size(), false);
    lacking_.push_back(body.surface.tiles.size());
    newest_given_.emplace_back(body.surface.tiles.size());
    felt_.push_back(std::make_unique<penetration::FeltSurface>(body.surface, body.limits));
  }
}

bool TileCache::begin_epoch() noexcept {
  Arrived mark;
  mark.what = Arrived::What::kEpoch;
  if (!arrived_.push(mark)) return false;
  for (auto& surface : newest_given_)
    for (std::atomic<std::uint64_t>& newest : surface) newest.store(0, std::memory_order_relaxed);
  return true;
}

bool TileCache::knows(const contact_service::SurfaceTile& where) const noexcept {
  return where.surface < newest_given_.size() && where.tile < newest_given_[where.surface].size();
}

TileCache::Put TileCache::put(const contact_service::SurfaceTile& where, const geometry::HeightTile& tile) noexcept {
  return put({where, tile, Arrived::What::kTile});
}

TileCache::Put TileCache::put_same(const contact_service::SurfaceTile& where, std::uint32_t version) noexcept {
  Arrived same;
  same.where = where, same.tile.version = version, same.what = Arrived::What::kSame;
  return put(same);
}

TileCache::Put TileCache::put(const Arrived& arrived) noexcept {
  const auto& [where, tile, what] = arrived;
  if (!knows(where)) return Put::kUnknown;
  std::atomic<std::uint64_t>& newest = newest_given_[where.surface][where.tile];
  if (newest.load(std::memory_order_relaxed) > tile.version) return Put::kTaken;
  if (!arrived_.push(arrived)) return Put::kFull;
  newest.store(std::uint64_t{tile.version} + 1, std::memory_order_relaxed);
  tiles_.store(tiles_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  return Put::kTaken;
}

std::uint32_t TileCache::take_arrived(std::uint32_t most) noexcept {
  Arrived arrived;
  std::uint32_t taken = 0;
  for (; taken < most && arrived_.pop(arrived); ++taken) {
    if (arrived.what == Arrived::What::kEpoch) {
      for (std::size_t body = 0; body < is_here_.size(); ++body) {
        is_here_[body].assign(is_here_[body].size(), false);
        lacking_[body] = is_here_[body].size();
      }
      has_old_ = true;
      continue;
    }
    const auto& [where, tile, what] = arrived;
    geometry::HeightTile& here = scene_.bodies[where.surface].surface.tiles[where.tile];
    if (what == Arrived::What::kSame) {
      here.version = tile.version;
    } else {
      here = tile;
      felt_[where.surface]->take_tile(where.tile);
    }
    lacking_[where.surface] -= !is_here_[where.surface][where.tile];
    is_here_[where.surface][where.tile] = true;
  }
  return taken;
}

bool TileCache::has(const contact_service::SurfaceTile& where) const noexcept {
  return is_here_[where.surface][where.tile];
}

// The outline's bound holds for the old remote's heights and for the new one's: those two are at most twice it apart.
double TileCache::off_m(const contact_service::SurfaceTile& where) const noexcept {
  const std::vector<double>& off_m = scene_.bodies[where.surface].off_m;
  return has(where) || off_m.empty() ? 0 : (has_old_ ? 2 : 1) * off_m[where.tile];
}

std::vector<contact_service::TouchableObject> TileCache::touchable() const {
  std::vector<contact_service::TouchableObject> all;
  for (std::size_t i = 0; i < felt_.size(); ++i) {
    const contact_service::FeltBody& body = scene_.bodies[i];
    all.push_back({&body.surface, body.material, body.X_WO, felt_[i].get(), body.motion ? &*body.motion : nullptr,
                   body.may_change, body.is_there});
  }
  return all;
}

bool TileCache::is_textured() const {
  return std::any_of(scene_.bodies.begin(), scene_.bodies.end(),
                     [](const contact_service::FeltBody& body) { return body.surface.is_textured(); });
}

}  // namespace farfeel::local_model
