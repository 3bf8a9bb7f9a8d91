#include "transport/control_messages.h"

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
std::span<const std::byte> write(const Bye& m, PayloadBuffer& to) noexcept {
  ByteWriter w(to);
  w.u8(static_cast<std::uint8_t>(m.reason));
  return w.written();
}

std::optional<Bye> read_bye(std::span<const std::byte> payload) noexcept {
  ByteReader r(payload);
  const std::uint8_t reason = r.u8();
  if (!r.is_at_end() || reason < 1 || reason > 2) return std::nullopt;
  return Bye{static_cast<ByeReason>(reason)};
}

std::span<const std::byte> write(const Offer& m, PayloadBuffer& to) noexcept {
  ByteWriter w(to);
  w.u32(m.object);
  w.u64(m.size);
  w.bytes(m.hash);
  return w.written();
}

std::optional<Offer> read_offer(std::span<const std::byte> payload) noexcept {
  ByteReader r(payload);
  Offer m;
  m.object = r.u32();
  m.size = r.u64();
  const auto hash = r.bytes(m.hash.size());
  if (!r.is_at_end() || m.size == 0 || m.size > kMaxObjectBytes) return std::nullopt;
  std::copy(hash.begin(), hash.end(), m.hash.begin());
  return m;
}

std::span<const std::byte> write(const Chunk& m, PayloadBuffer& to) noexcept {
  ByteWriter w(to);
  w.u32(m.object);
  w.u32(m.index);
  w.i64(m.t_send_ns);
  w.bytes(m.bytes);
  return w.written();
}

std::optional<Chunk> read_chunk(std::span<const std::byte> payload) noexcept {
  ByteReader r(payload);
  Chunk m;
  m.object = r.u32();
  m.index = r.u32();
  m.t_send_ns = r.i64();
  m.bytes = r.bytes(r.remaining());
  if (!r.ok() || m.t_send_ns < 0 || m.bytes.empty() || m.bytes.size() > kChunkBytes ||
      m.index >= chunks_of(kMaxObjectBytes))
    return std::nullopt;
  return m;
}

std::span<const std::byte> write(const Acknowledge& m, PayloadBuffer& to) noexcept {
  ByteWriter w(to);
  w.u32(m.object);
  w.u32(m.complete);
  w.i64(m.t_echo_ns);
  w.u32(m.hold_us);
  w.u16(static_cast<std::uint16_t>(m.ranges));
  for (std::size_t i = 0; i < m.ranges && i < Acknowledge::kMaxRanges; ++i) {
    w.u32(m.range[i].begin);
    w.u32(m.range[i].end);
  }
  return w.written();
}

std::optional<Acknowledge> read_acknowledge(std::span<const std::byte> payload) noexcept {
  ByteReader r(payload);
  Acknowledge m;
  m.object = r.u32();
  m.complete = r.u32();
  m.t_echo_ns = r.i64();
  m.hold_us = r.u32();
  m.ranges = r.u16();
  if (!r.ok() || m.t_echo_ns < 0 || m.ranges > Acknowledge::kMaxRanges) return std::nullopt;
  std::uint32_t beyond = m.complete;
  for (std::size_t i = 0; i < m.ranges; ++i) {
    auto& range = m.range[i];
    range.begin = r.u32();
    range.end = r.u32();
    if (range.begin <= beyond || range.end <= range.begin) return std::nullopt;
    beyond = range.end;
  }
  if (!r.is_at_end() || beyond > chunks_of(kMaxObjectBytes)) return std::nullopt;
  return m;
}

}  // namespace farfeel::transport
