#include "master_station/session/tile_receiver.h"

#include <algorithm>
#include <tuple>

namespace farfeel::master_station {

bool TileReceiver::begin_epoch() {
  if (!cache_.begin_epoch()) return false;
  halves_.clear();
  for (const auto& [place, tile] : waiting_) held_.erase(place);  // the cache never had them
  waiting_.clear();
  waiting_same_.clear();
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
  if (part->is_same) return put_same(where, part->version);
  if (part->rows == geometry::kTileSide) return put(where, {part->version, part->coefficients});
  const auto [at, is_new] = halves_.try_emplace({where.surface, where.tile});
  if (!at->second.add(*part)) return;
  put(where, at->second.tile());
  halves_.erase(at);
}

void TileReceiver::put(const contact_service::SurfaceTile& where, const geometry::HeightTile& tile) {
  const Place place{where.surface, where.tile};
  const auto given = cache_.given(where);
  const auto waits = waiting_.find(place);
  if ((given && *given >= tile.version) || (waits != waiting_.end() && waits->second.version >= tile.version)) return;
  held_[place] = codecs::hash_of(tile);
  waiting_same_.erase(place);
  if (cache_.put(where, tile) == local_model::TileCache::Put::kFull) {
    waiting_.insert_or_assign(place, tile);
  } else if (waits != waiting_.end()) {
    waiting_.erase(waits);
  }
}

void TileReceiver::put_same(const contact_service::SurfaceTile& where, std::uint32_t version) {
  if (!held_.contains({where.surface, where.tile})) {
    ++malformed_;
    return;
  }
  if (waiting_.contains({where.surface, where.tile})) return;  // it will be put itself
  if (cache_.put_same(where, version) == local_model::TileCache::Put::kFull)
    waiting_same_[{where.surface, where.tile}] = version;
}

std::optional<codecs::TilesHeld> TileReceiver::next_held() {
  auto at = next_told_ ? held_.lower_bound(*next_told_) : held_.end();
  next_told_.reset();
  if (at == held_.end()) return std::nullopt;
  codecs::TilesHeld told;
  std::tie(told.surface, told.first) = at->first;
  for (; at != held_.end() && at->first.first == told.surface; ++at) {
    const std::uint32_t i = at->first.second - told.first;
    if (i >= codecs::TilesHeld::kMost) break;
    told.hashes[i] = at->second, told.count = i + 1;
  }
  next_told_ = Place{told.surface, told.first + told.count};
  return told;
}

void TileReceiver::put_waiting() {
  std::erase_if(waiting_, [this](const auto& waiting) {
    const auto& [where, tile] = waiting;
    return cache_.put({where.first, where.second}, tile) != local_model::TileCache::Put::kFull;
  });
  std::erase_if(waiting_same_, [this](const auto& waiting) {
    const auto& [where, version] = waiting;
    return cache_.put_same({where.first, where.second}, version) != local_model::TileCache::Put::kFull;
  });
}

}  // namespace farfeel::master_station
