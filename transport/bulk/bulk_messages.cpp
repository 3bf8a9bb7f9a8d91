#include "transport/bulk/bulk_messages.h"

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
namespace {

std::span<const std::byte> whole(const ByteWriter& w) {
  return w.ok() ? w.written() : std::span<const std::byte>{};
}

void put_type(ByteWriter& w, BulkType type) {
  w.u8(static_cast<std::uint8_t>(type));
}

bool has_type(ByteReader& r, BulkType type) {
  return r.u8() == static_cast<std::uint8_t>(type);
}

}  // namespace

std::span<const std::byte> write(const BulkHead& m, std::span<std::byte> to) noexcept {
  ByteWriter w(to);
  w.u8(m.type);
  w.u32(m.number);
  w.u32(m.t_send_us);
  w.u8(m.spacing);
  return whole(w);
}

std::optional<BulkHead> read_bulk_head(std::span<const std::byte> message) noexcept {
  ByteReader r(message);
  BulkHead m;
  m.type = r.u8();
  m.number = r.u32();
  m.t_send_us = r.u32();
  m.spacing = r.u8();
  if (!r.ok() || !is_numbered(m.type) || message.size() > kMostMessageBytes) return std::nullopt;
  return m;
}

std::span<const std::byte> write(const Receipt& m, std::span<std::byte> to) noexcept {
  ByteWriter w(to);
  put_type(w, BulkType::kReceipt);
  w.u32(m.newest);
  w.u32(m.echo_us);
  w.u32(m.arrival_us);
  w.u32(m.hold_us);
  w.u8(m.ranges);
  w.u8(m.stamps);
  for (std::size_t i = 0; i < m.ranges; ++i) {
    w.u16(m.range[i].gap);
    w.u16(m.range[i].length);
  }
  for (std::size_t i = 0; i < m.stamps; ++i) {
    w.u8(m.stamp[i].back);
    w.u16(static_cast<std::uint16_t>(m.stamp[i].earlier_us));
  }
  return whole(w);
}

std::optional<Receipt> read_receipt(std::span<const std::byte> message) noexcept {
  ByteReader r(message);
  Receipt m;
  if (!has_type(r, BulkType::kReceipt)) return std::nullopt;
  m.newest = r.u32();
  m.echo_us = r.u32();
  m.arrival_us = r.u32();
  m.hold_us = r.u32();
  m.ranges = r.u8();
  m.stamps = r.u8();
  if (!r.ok() || m.ranges == 0 || m.ranges > Receipt::kMostRanges || m.stamps > Receipt::kMostStamps)
    return std::nullopt;
  for (std::size_t i = 0; i < m.ranges; ++i) {
    m.range[i].gap = r.u16();
    m.range[i].length = r.u16();
    if (m.range[i].length == 0 || (m.range[i].gap == 0) != (i == 0)) return std::nullopt;
  }
  for (std::size_t i = 0; i < m.stamps; ++i) {
    m.stamp[i].back = r.u8();
    m.stamp[i].earlier_us = static_cast<std::int16_t>(r.u16());
    if (m.stamp[i].back == 0) return std::nullopt;
  }
  if (!r.is_at_end()) return std::nullopt;
  return m;
}

std::span<const std::byte> write(const ObjectOffer& m, std::span<std::byte> to) noexcept {
  ByteWriter w(to);
  put_type(w, BulkType::kObjectOffer);
  w.u32(m.id);
  w.u32(m.slot);
  w.u16(m.ask);
  w.u64(m.size);
  w.bytes(m.hash);
  return whole(w);
}

std::optional<ObjectOffer> read_object_offer(std::span<const std::byte> message) noexcept {
  ByteReader r(message);
  ObjectOffer m;
  if (!has_type(r, BulkType::kObjectOffer)) return std::nullopt;
  m.id = r.u32();
  m.slot = r.u32();
  m.ask = r.u16();
  m.size = r.u64();
  const auto hash = r.bytes(m.hash.size());
  // A size beyond what is allowed is read, so that it can be refused with the reason.
  if (!r.is_at_end() || m.id == 0 || m.size == 0) return std::nullopt;
  std::copy(hash.begin(), hash.end(), m.hash.begin());
  return m;
}

std::span<const std::byte> write(const ObjectAnswer& m, std::span<std::byte> to) noexcept {
  ByteWriter w(to);
  put_type(w, BulkType::kObjectAnswer);
  w.u32(m.id);
  w.u32(m.revision);
  w.u16(m.ask);
  w.u8(static_cast<std::uint8_t>(m.state));
  w.u8(static_cast<std::uint8_t>(m.reason));
  w.u8(m.round);
  w.u8(m.ranges);
  for (std::size_t i = 0; i < m.ranges; ++i) {
    w.u32(m.range[i].begin);
    w.u32(m.range[i].end);
  }
  return whole(w);
}

std::optional<ObjectAnswer> read_object_answer(std::span<const std::byte> message) noexcept {
  ByteReader r(message);
  ObjectAnswer m;
  if (!has_type(r, BulkType::kObjectAnswer)) return std::nullopt;
  m.id = r.u32();
  m.revision = r.u32();
  m.ask = r.u16();
  const std::uint8_t state = r.u8(), reason = r.u8();
  m.round = r.u8();
  m.ranges = r.u8();
  if (!r.ok() || m.id == 0 || state > 3 || reason > 4 || m.ranges > ObjectAnswer::kMostRanges) return std::nullopt;
  m.state = static_cast<ObjectState>(state);
  m.reason = static_cast<RefusedBecause>(reason);
  if ((m.state == ObjectState::kRefused) != (m.reason != RefusedBecause::kNothing)) return std::nullopt;
  if (m.ranges > 0 && m.state != ObjectState::kReceiving) return std::nullopt;
  for (std::size_t i = 0; i < m.ranges; ++i) {
    m.range[i].begin = r.u32();
    m.range[i].end = r.u32();
    if (m.range[i].begin >= m.range[i].end) return std::nullopt;
    if (i > 0 && m.range[i].begin <= m.range[i - 1].end) return std::nullopt;
  }
  if (!r.is_at_end()) return std::nullopt;
  return m;
}

std::span<const std::byte> write(const ObjectWithdrawal& m, std::span<std::byte> to) noexcept {
  ByteWriter w(to);
  put_type(w, BulkType::kObjectWithdrawal);
  w.u32(m.id);
  return whole(w);
}

std::optional<ObjectWithdrawal> read_object_withdrawal(std::span<const std::byte> message) noexcept {
  ByteReader r(message);
  ObjectWithdrawal m;
  if (!has_type(r, BulkType::kObjectWithdrawal)) return std::nullopt;
  m.id = r.u32();
  if (!r.is_at_end() || m.id == 0) return std::nullopt;
  return m;
}

std::span<const std::byte> write(const ObjectPiece& m, std::span<std::byte> to) noexcept {
  ByteWriter w(to);
  w.u32(m.id);
  w.u32(m.granule);
  w.bytes(m.bytes);
  return whole(w);
}

std::optional<ObjectPiece> read_object_piece(std::span<const std::byte> body) noexcept {
  ByteReader r(body);
  ObjectPiece m;
  m.id = r.u32();
  m.granule = r.u32();
  m.bytes = r.bytes(r.remaining());
  if (!r.ok() || m.id == 0 || m.bytes.empty()) return std::nullopt;
  return m;
}

}  // namespace farfeel::transport
