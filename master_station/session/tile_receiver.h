// Height tiles as they come in: parts into whole tiles, whole tiles into the cache, their names back to the slave.
#pragma once

#include <cstdint>
#include <map>
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
  /// Whether there is something to send back: names, or every 100 ms that tiles are wanted.
  [[nodiscard]] bool owes(std::int64_t now_ns) const { return owed_.count > 0 || now_ns - told_ns_ > kTell_ns; }
  [[nodiscard]] bool is_full() const { return owed_.count == codecs::TileAcknowledge::kMost; }
  /// Writes them, and owes nothing any more. Returns the payload's size.
  [[nodiscard]] std::size_t acknowledge(std::span<std::byte> to, std::int64_t now_ns) noexcept;

  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }  ///< of all tile messages, repeated ones too
  [[nodiscard]] std::uint64_t malformed() const { return malformed_; }

 private:
  static constexpr std::int64_t kTell_ns = 100'000'000;
  void put(const contact_service::SurfaceTile&, const geometry::HeightTile&);

  local_model::TileCache& cache_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, codecs::TileAssembly> halves_;  // tiles that came in two parts
  codecs::TileAcknowledge owed_;
  std::uint64_t bytes_ = 0, malformed_ = 0;
  std::int64_t told_ns_ = -kTell_ns - 1;
};

}  // namespace farfeel::master_station
