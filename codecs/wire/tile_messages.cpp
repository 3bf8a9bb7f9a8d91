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

std::size_t write(const TileRequest& message, std::span<std::byte> to) noexcept {
  transport::ByteWriter w(to);
  w.u32(message.round);
  return w.ok() ? w.size() : 0;
}

std::optional<TileRequest> read_tile_request(std::span<const std::byte> payload) noexcept {
  transport::ByteReader r(payload);
  const TileRequest message{r.u32()};
  if (!r.is_at_end() || message.round == 0) return std::nullopt;
  return message;
}

std::size_t write(const TilesHeld& message, std::span<std::byte> to) noexcept {
  transport::ByteWriter w(to);
  w.u32(message.surface);
  w.u32(message.first);
  for (std::uint32_t i = 0; i < message.count; ++i) w.u32(message.hashes[i]);
  return w.ok() ? w.size() : 0;
}

std::optional<TilesHeld> read_tiles_held(std::span<const std::byte> payload) noexcept {
  transport::ByteReader r(payload);
  TilesHeld message;
  message.surface = r.u32();
  message.first = r.u32();
  if (!r.ok() || r.is_at_end() || r.remaining() > 4 * TilesHeld::kMost || r.remaining() % 4 != 0) return std::nullopt;
  message.count = static_cast<std::uint32_t>(r.remaining() / 4);
  for (std::uint32_t i = 0; i < message.count; ++i) message.hashes[i] = r.u32();
  return message;
}

}  // namespace farfeel::codecs
