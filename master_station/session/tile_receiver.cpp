#include "master_station/session/tile_receiver.h"

#include <algorithm>

namespace farfeel::master_station {

bool TileReceiver::begin_epoch() {
  if (!cache_.begin_epoch()) return false;
  halves_.clear();
  waiting_.clear();
  return true;
}

void TileReceiver::on_tile(std::span<const std::byte> payload) {
  bytes_ += payload.size();
  const auto message = codecs::read_tile_message(payload);
  const auto part = message ? codecs::decoded_tile_part(message->part) : tl::unexpected(std::string());
  if (!part || !cache_.knows({message->surface, part->tile})) {
    ++malformed_;
    return;
  }
  const contact_service::SurfaceTile where{message->surface, part->tile};
  if (part->rows == geometry::kTileSide) return put(where, {part->version, part->coefficients});
  const auto [at, is_new] = halves_.try_emplace({where.surface, where.tile});
  if (!at->second.add(*part)) return;
  put(where, at->second.tile());
  halves_.erase(at);
}

void TileReceiver::put(const contact_service::SurfaceTile& where, const geometry::HeightTile& tile) {
  if (cache_.put(where, tile) != local_model::TileCache::Put::kFull) return;
  const auto [at, is_new] = waiting_.try_emplace({where.surface, where.tile}, tile);
  if (!is_new && at->second.version < tile.version) at->second = tile;
}

void TileReceiver::put_waiting() {
  std::erase_if(waiting_, [this](const auto& waiting) {
    const auto& [where, tile] = waiting;
    return cache_.put({where.first, where.second}, tile) != local_model::TileCache::Put::kFull;
  });
}

}  // namespace farfeel::master_station
