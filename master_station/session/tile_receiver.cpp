#include "master_station/session/tile_receiver.h"

#include <algorithm>

namespace farfeel::master_station {
namespace {

constexpr std::size_t kMostHalves = 256;  // half a megabyte: more than a round trip's worth of tiles

}  // namespace

bool TileReceiver::begin_epoch() {
  if (!cache_.begin_epoch()) return false;
  halves_.clear();
  owed_.count = 0;
  return true;
}

void TileReceiver::on_tile(std::span<const std::byte> payload) {
  bytes_ += payload.size();
  const auto message = codecs::read_tile_message(payload);
  const auto part = message ? codecs::decoded_tile_part(message->part) : tl::unexpected(std::string());
  if (!part) {
    ++malformed_;
    return;
  }
  const contact_service::SurfaceTile where{message->surface, part->tile};
  if (part->rows == geometry::kTileSide) {
    put(where, {part->version, part->coefficients});
    return;
  }
  if (halves_.size() >= kMostHalves) halves_.clear();  // they come again
  const auto [at, is_new] = halves_.try_emplace({where.surface, where.tile});
  if (!at->second.add(*part)) return;
  put(where, at->second.tile());
  halves_.erase(at);
}

void TileReceiver::put(const contact_service::SurfaceTile& where, const geometry::HeightTile& tile) {
  switch (cache_.put(where, tile)) {
    case local_model::TileCache::Put::kTaken:
      if (owed_.count < codecs::TileAcknowledge::kMost)
        owed_.tiles[owed_.count++] = {where.surface, where.tile, tile.version};
      break;
    case local_model::TileCache::Put::kFull:
      break;  // unacknowledged, it comes again
    case local_model::TileCache::Put::kUnknown:
      ++malformed_;
      break;
  }
}

std::size_t TileReceiver::acknowledge(std::span<std::byte> to, std::int64_t now_ns) noexcept {
  told_ns_ = now_ns;
  const std::size_t size = codecs::write(owed_, to);
  owed_.count = 0;
  return size;
}

}  // namespace farfeel::master_station
