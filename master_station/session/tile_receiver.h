// Height tiles as they come in: parts into whole tiles, whole tiles into the cache.
//
// A datagram that came is receipted, and what was in it does not come again: so nothing that is of use is dropped here.
// What the cache has no room for yet waits. At most one of each of the scene's tiles does, as large as the cache
// itself.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include "codecs/tile/tile_codec.h"
#include "codecs/wire/tile_messages.h"
#include "haptic_core/local_model/tile_cache.h"

namespace farfeel::master_station {

/// The io thread's.
class TileReceiver {
 public:
  explicit TileReceiver(local_model::TileCache& cache) : cache_(cache) {}

  /// The slave was started anew. Until it is true, no tile may be given to on_tile.
  [[nodiscard]] bool begin_epoch();
  /// Payload of a tile message, from anybody: what is none changes nothing but a counter.
  void on_tile(std::span<const std::byte> payload);
  /// Another session: what is held is told from the beginning.
  void begin_telling() { next_told_ = Place{0, 0}; }
  /// The next of it; nothing once all is told. The slave says of what is still so that it is, and does not send it.
  [[nodiscard]] std::optional<codecs::TilesHeld> next_held();
  /// Gives the cache what it had no room for. Call it some times a second.
  void put_waiting();

  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }  ///< of all tile messages, repeated ones too
  [[nodiscard]] std::uint64_t malformed() const { return malformed_; }

 private:
  using Place = std::pair<std::uint32_t, std::uint32_t>;  // surface, tile
  void put(const contact_service::SurfaceTile&, const geometry::HeightTile&);
  void put_same(const contact_service::SurfaceTile&, std::uint32_t version);

  local_model::TileCache& cache_;
  std::map<Place, codecs::TileAssembly> halves_;   // tiles that come in two parts
  std::map<Place, geometry::HeightTile> waiting_;  // the newest of each tile that found the cache full
  std::map<Place, std::uint32_t> waiting_same_;    // versions, likewise
  std::map<Place, std::uint32_t> held_;            // hashes of the newest of each
  std::optional<Place> next_told_;                 // while not all is told
  std::uint64_t bytes_ = 0, malformed_ = 0;
};

}  // namespace farfeel::master_station
