#include "codecs/wire/tile_messages.h"

#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {

std::size_t write(const TileMessage& message, std::span<std::byte> to) noexcept {
  transport::ByteWriter w(to);
  w.u32(message.surface);
  w.bytes(message.part);
  return w.ok() ? w.size() : 0;
}

std::optional<TileMessage> read_tile_message(std::span<const std::byte> payload) noexcept {
  transport::ByteReader r(payload);
  TileMessage message;
  message.surface = r.u32();
  message.part = r.bytes(r.remaining());
  if (!r.ok() || message.part.empty()) return std::nullopt;
  return message;
}

std::size_t write(const TileAcknowledge& message, std::span<std::byte> to) noexcept {
  transport::ByteWriter w(to);
  w.u16(static_cast<std::uint16_t>(message.count));
  for (std::size_t i = 0; i < message.count; ++i) {
    w.u32(message.tiles[i].surface);
    w.u32(message.tiles[i].tile);
    w.u32(message.tiles[i].version);
  }
  return w.ok() ? w.size() : 0;
}

std::optional<TileAcknowledge> read_tile_acknowledge(std::span<const std::byte> payload) noexcept {
  transport::ByteReader r(payload);
  TileAcknowledge message;
  message.count = r.u16();
  if (!r.ok() || message.count > TileAcknowledge::kMost) return std::nullopt;
  for (std::size_t i = 0; i < message.count; ++i) {
    message.tiles[i].surface = r.u32();
    message.tiles[i].tile = r.u32();
    message.tiles[i].version = r.u32();
  }
  if (!r.is_at_end()) return std::nullopt;
  return message;
}

}  // namespace farfeel::codecs
