#include "transport/control_messages.h"

#include <algorithm>

namespace farfeel::transport {
namespace {

bool is_printable(std::span<const std::byte> text) {
  return std::all_of(text.begin(), text.end(),
                     [](std::byte b) { return b >= std::byte{0x20} && b <= std::byte{0x7E}; });
}

bool is_zero(std::span<const std::byte> bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](std::byte b) { return b == std::byte{0}; });
}

std::span<const std::byte> as_bytes(std::string_view text) {
  return std::as_bytes(std::span(text));
}

}  // namespace

std::span<const std::byte> write(const KeepAlive&, PayloadBuffer& to) noexcept {
  ByteWriter w(to);
  w.pad_to(KeepAlive::kBytes);
  return w.written();
}

std::optional<KeepAlive> read_keep_alive(std::span<const std::byte> payload) noexcept {
  if (payload.size() != KeepAlive::kBytes || !is_zero(payload)) return std::nullopt;
  return KeepAlive{};
}

std::span<const std::byte> write(const Hello& m, PayloadBuffer& to) noexcept {
  ByteWriter w(to);
  w.u64(m.master);
  w.u32(m.attempt);
  w.i64(m.t_send_ns);
  w.pad_to(kMaxPayloadBytes);
  return w.written();
}

std::optional<Hello> read_hello(std::span<const std::byte> payload) noexcept {
  ByteReader r(payload);
  Hello m;
  m.master = r.u64();
  m.attempt = r.u32();
  m.t_send_ns = r.i64();
  const auto padding = r.bytes(r.remaining());
  if (!r.ok() || payload.size() != kMaxPayloadBytes || !is_zero(padding) || m.master == 0 || m.t_send_ns < 0)
    return std::nullopt;
  return m;
}

std::span<const std::byte> write(const Welcome& m, PayloadBuffer& to) noexcept {
  ByteWriter w(to);
  w.u64(m.master);
  w.u32(m.attempt);
  w.i64(m.t_echo_ns);
  w.u64(m.slave);
  return w.written();
}

std::optional<Welcome> read_welcome(std::span<const std::byte> payload) noexcept {
  ByteReader r(payload);
  Welcome m;
  m.master = r.u64();
  m.attempt = r.u32();
  m.t_echo_ns = r.i64();
  m.slave = r.u64();
  if (!r.is_at_end() || m.t_echo_ns < 0) return std::nullopt;
  return m;
}

std::span<const std::byte> write(const Refusal& m, PayloadBuffer& to) noexcept {
  const std::string_view text = m.text.substr(0, Refusal::kMaxText);
  ByteWriter w(to);
  w.u8(static_cast<std::uint8_t>(m.reason));
  w.u64(m.master);
  w.u16(static_cast<std::uint16_t>(text.size()));
  w.bytes(as_bytes(text));
  return w.written();
}

std::optional<Refusal> read_refusal(std::span<const std::byte> payload) noexcept {
  ByteReader r(payload);
  Refusal m;
  const std::uint8_t reason = r.u8();
  m.reason = static_cast<RefusalReason>(reason);
  m.master = r.u64();
  const std::uint16_t size = r.u16();
  const auto text = r.bytes(size);
  if (!r.is_at_end() || reason < 1 || reason > 3 || size > Refusal::kMaxText || !is_printable(text))
    return std::nullopt;
  m.text = {reinterpret_cast<const char*>(text.data()), text.size()};
  return m;
}

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
