#include "transport/packet.h"

namespace farfeel::transport {

std::size_t write_packet(const Header& header, std::span<const std::byte> payload, std::span<std::byte> to) noexcept {
  const std::size_t size = kHeaderBytes + payload.size();
  if (size > kMaxDatagramBytes || size > to.size()) return 0;
  ByteWriter w(to);
  w.u16(kMagic);
  w.u8(kVersion);
  w.u8(static_cast<std::uint8_t>(header.type));
  w.u16(static_cast<std::uint16_t>(size));
  w.u16(0);
  w.u32(header.session);
  w.u32(header.sequence);
  if (payload.data() != to.data() + kHeaderBytes) w.bytes(payload);
  return size;
}

Packet read_packet(std::span<const std::byte> datagram) noexcept {
  Packet packet;
  const auto faulty = [&](HeaderFault fault) {
    packet.fault = fault;
    packet.payload = {};
    return packet;
  };
  ByteReader r(datagram);
  if (r.u16() != kMagic) return faulty(HeaderFault::kNotOurs);
  const std::uint8_t version = r.u8();
  packet.header.type = static_cast<PacketType>(r.u8());
  if (!r.ok()) return faulty(HeaderFault::kNotOurs);
  if (version != kVersion) return faulty(HeaderFault::kOtherVersion);
  const std::uint16_t length = r.u16(), zero = r.u16();
  packet.header.session = r.u32();
  packet.header.sequence = r.u32();
  if (!r.ok() || length != datagram.size() || length > kMaxDatagramBytes || zero != 0)
    return faulty(HeaderFault::kLength);
  if (name_of(packet.header.type).empty()) return faulty(HeaderFault::kUnknownType);
  packet.payload = datagram.subspan(kHeaderBytes);
  return packet;
}

std::string_view name_of(PacketType type) noexcept {
  switch (type) {
    case PacketType::kHello:
      return "hello";
    case PacketType::kWelcome:
      return "welcome";
    case PacketType::kRefusal:
      return "refusal";
    case PacketType::kBye:
      return "bye";
    case PacketType::kKeepAlive:
      return "keep-alive";
    case PacketType::kOffer:
      return "offer";
    case PacketType::kChunk:
      return "chunk";
    case PacketType::kAcknowledge:
      return "acknowledge";
    case PacketType::kSlaveStatus:
      return "slave status";
    case PacketType::kTile:
      return "tile";
    case PacketType::kTileAcknowledge:
      return "tile acknowledge";
    case PacketType::kPoseSample:
      return "pose sample";
    case PacketType::kContactSet:
      return "contact set";
  }
  return {};
}

}  // namespace farfeel::transport
