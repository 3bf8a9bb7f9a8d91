#include "transport/relay/relay_messages.h"

#include <algorithm>
#include <cassert>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
namespace {

void write_address(ByteWriter& writer, const std::optional<Address>& address) noexcept {
  const Address value = address.value_or(Address{});
  writer.u8(!address ? 0 : value.is_ipv6 ? 6 : 4);
  writer.u8(0);
  writer.u16(value.port);
  writer.bytes(std::as_bytes(std::span(value.ip)));
}

// A relay tells public addresses alone: none has a scope, and a link-local one is of no use to the other end.
bool read_address(ByteReader& reader, std::optional<Address>& out) noexcept {
  const std::uint8_t family = reader.u8();
  const std::uint8_t zero = reader.u8();
  Address address;
  address.is_ipv6 = family == 6;
  address.port = reader.u16();
  const auto ip = reader.bytes(address.ip.size());
  if (!reader.ok() || zero != 0) return false;
  std::transform(ip.begin(), ip.end(), address.ip.begin(),
                 [](std::byte b) { return std::to_integer<std::uint8_t>(b); });
  if (family == 0) {
    out = std::nullopt;
    return address == Address{};
  }
  const bool has_rest = std::any_of(address.ip.begin() + 4, address.ip.end(), [](std::uint8_t b) { return b != 0; });
  if ((family != 4 && family != 6) || (family == 4 && has_rest) || address.port == 0 || address.is_any()) return false;
  out = address;
  return true;
}

Mac16 read_mac(ByteReader& reader) noexcept {
  Mac16 mac{};
  const auto bytes = reader.bytes(mac.size());
  std::copy(bytes.begin(), bytes.end(), mac.begin());
  return mac;
}

ByteWriter begin(RelayType type, std::span<std::byte> to, std::size_t size) noexcept {
  assert(to.size() >= size);
  ByteWriter writer(to.first(size));
  writer.u8(static_cast<std::uint8_t>(type));
  writer.u8(kRelayVersion);
  return writer;
}

void sign(std::span<std::byte> message, const Key32& key) noexcept {
  const auto body = message.first(message.size() - sizeof(Mac16));
  const Mac16 mac = keyed_mac(key, body);
  std::copy(mac.begin(), mac.end(), message.begin() + static_cast<std::ptrdiff_t>(body.size()));
}

// A reader past type and version, or one that is not ok.
ByteReader begin(RelayType type, std::span<const std::byte> bytes, std::size_t size) noexcept {
  if (bytes.size() != size || bytes[0] != static_cast<std::byte>(type) || bytes[1] != std::byte{kRelayVersion}) {
    ByteReader nothing({});
    (void)nothing.u8();
    return nothing;
  }
  return ByteReader(bytes.subspan(2));
}

}  // namespace

std::optional<std::uint8_t> relay_type(std::span<const std::byte> datagram) noexcept {
  if (datagram.empty() || datagram[0] < std::byte{kFirstRelayType}) return std::nullopt;
  return std::to_integer<std::uint8_t>(datagram[0]);
}

void write(const RegisterMessage& m, const Key32& key, std::span<std::byte> to) noexcept {
  ByteWriter writer = begin(RelayType::kRegister, to, RegisterMessage::kBytes);
  writer.u8(static_cast<std::uint8_t>(m.role));
  writer.u8(m.slot);
  writer.u64(m.nonce);
  writer.u64(m.instance);
  m.grant.write(writer);
  writer.bytes(m.room);
  writer.bytes(m.cookie);
  writer.pad_to(RegisterMessage::kBytes - sizeof(Mac16));
  sign(to.first(RegisterMessage::kBytes), key);
}

void write(const ChallengeMessage& m, std::span<std::byte> to) noexcept {
  ByteWriter writer = begin(RelayType::kChallenge, to, ChallengeMessage::kBytes);
  writer.u16(0);
  writer.u64(m.nonce);
  writer.bytes(m.cookie);
}

void write(const RegisteredMessage& m, const Key32& key, std::span<std::byte> to) noexcept {
  ByteWriter writer = begin(RelayType::kRegistered, to, RegisteredMessage::kBytes);
  writer.u8(0);
  writer.u8(m.slot);
  writer.u64(m.nonce);
  writer.bytes(m.cookie);
  write_address(writer, m.own);
  write_address(writer, m.peer);
  writer.bytes(m.probe_secret);
  sign(to.first(RegisteredMessage::kBytes), key);
}

void write(const RefusedMessage& m, std::span<std::byte> to) noexcept {
  ByteWriter writer = begin(RelayType::kRefused, to, RefusedMessage::kBytes);
  writer.u8(static_cast<std::uint8_t>(m.reason));
  writer.u8(0);
  writer.u64(m.nonce);
  writer.i64(m.wall_clock_s);
}

void write(const ProbeMessage& m, std::span<std::byte> to) noexcept {
  ByteWriter writer = begin(RelayType::kProbe, to, ProbeMessage::kBytes);
  writer.u8(m.has_heard ? 1 : 0);
  writer.u8(m.slot);
  writer.bytes(m.secret);
}

std::optional<RegisterMessage> read_register(std::span<const std::byte> bytes) noexcept {
  ByteReader reader = begin(RelayType::kRegister, bytes, RegisterMessage::kBytes);
  RegisterMessage m;
  const std::uint8_t role = reader.u8();
  m.slot = reader.u8();
  m.nonce = reader.u64();
  m.instance = reader.u64();
  m.grant = RelayGrant::read(reader);
  m.room = read_mac(reader);
  m.cookie = read_mac(reader);
  if (!reader.ok() || role > 1 || m.slot >= kRelaySlots) return std::nullopt;
  m.role = static_cast<RelayRole>(role);
  return m;
}

std::optional<ChallengeMessage> read_challenge(std::span<const std::byte> bytes) noexcept {
  ByteReader reader = begin(RelayType::kChallenge, bytes, ChallengeMessage::kBytes);
  ChallengeMessage m;
  (void)reader.u16();
  m.nonce = reader.u64();
  m.cookie = read_mac(reader);
  return reader.is_at_end() ? std::optional(m) : std::nullopt;
}

std::optional<RegisteredMessage> read_registered(std::span<const std::byte> bytes) noexcept {
  ByteReader reader = begin(RelayType::kRegistered, bytes, RegisteredMessage::kBytes);
  RegisteredMessage m;
  (void)reader.u8();
  m.slot = reader.u8();
  m.nonce = reader.u64();
  m.cookie = read_mac(reader);
  std::optional<Address> own;
  if (!read_address(reader, own) || !own || !read_address(reader, m.peer)) return std::nullopt;
  m.own = *own;
  m.probe_secret = read_mac(reader);
  return reader.ok() && m.slot < kRelaySlots ? std::optional(m) : std::nullopt;
}

std::optional<RefusedMessage> read_refused(std::span<const std::byte> bytes) noexcept {
  ByteReader reader = begin(RelayType::kRefused, bytes, RefusedMessage::kBytes);
  RefusedMessage m;
  const std::uint8_t reason = reader.u8();
  (void)reader.u8();
  m.nonce = reader.u64();
  m.wall_clock_s = reader.i64();
  if (!reader.is_at_end() || reason < 1 || reason > 5) return std::nullopt;
  m.reason = static_cast<RelayRefusal>(reason);
  return m;
}

std::optional<ProbeMessage> read_probe(std::span<const std::byte> bytes) noexcept {
  ByteReader reader = begin(RelayType::kProbe, bytes, ProbeMessage::kBytes);
  ProbeMessage m;
  const std::uint8_t heard = reader.u8();
  m.slot = reader.u8();
  m.secret = read_mac(reader);
  if (!reader.is_at_end() || heard > 1 || m.slot >= kRelaySlots) return std::nullopt;
  m.has_heard = heard == 1;
  return m;
}

bool is_signed(std::span<const std::byte> message, const Key32& key) noexcept {
  if (message.size() < sizeof(Mac16)) return false;
  Mac16 mac;
  std::copy_n(message.end() - static_cast<std::ptrdiff_t>(sizeof mac), sizeof mac, mac.begin());
  return is_same_secret(mac, keyed_mac(key, message.first(message.size() - sizeof mac)));
}

}  // namespace farfeel::transport
