// One datagram from anybody, through the header and every payload's reader. What is accepted must be written again to
// the same bytes: then nothing was read that is not in the layout, and nothing in the layout was ignored.

#include <cstdlib>
#include <cstring>

#include "codecs/wire/haptic_messages.h"
#include "codecs/wire/slave_status.h"
#include "codecs/wire/tile_messages.h"
#include "transport/control_messages.h"

using namespace farfeel;

namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

bool is_same(std::span<const std::byte> a, std::span<const std::byte> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size()) == 0);
}

template <typename Message>
void expect_again(const std::optional<Message>& message, std::span<const std::byte> payload) {
  if (!message) return;
  transport::PayloadBuffer again;
  demand(is_same(write(*message, again), payload));
}

void read_pose(std::span<const std::byte> payload) {
  codecs::PoseSample sample;
  if (codecs::read(payload, sample) != codecs::Fault::kNone) return;
  demand(spatial::is_valid(sample.X_WT) && spatial::is_finite(sample.V_WT_W));
  transport::PayloadBuffer again;
  demand(is_same(std::span(again).first(codecs::write(sample, again)), payload));
}

// Normals are made unit in double, and longer records lose what this version does not know: so compare the second time.
void read_contacts(std::span<const std::byte> payload) {
  codecs::ContactAnswer answer, back;
  if (codecs::read(payload, answer) != codecs::Fault::kNone) return;
  demand(answer.set.count <= contact::kMaxContacts && spatial::is_valid(answer.set.X_WT));
  transport::PayloadBuffer first, second;
  const std::size_t size = codecs::write(answer, first);
  demand(size > 0 && codecs::read(std::span(first).first(size), back) == codecs::Fault::kNone);
  demand(back.set.count == answer.set.count);
  demand(codecs::write(back, second) == size);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto datagram = std::as_bytes(std::span(bytes, size));
  const transport::Packet packet = transport::read_packet(datagram);
  if (!packet.ok()) return 0;
  std::array<std::byte, transport::kMaxDatagramBytes> again;
  demand(is_same(std::span(again).first(transport::write_packet(packet.header, packet.payload, again)), datagram));
  const auto payload = packet.payload;
  switch (packet.header.type) {
    case transport::PacketType::kHello:
      expect_again(transport::read_hello(payload), payload);
      break;
    case transport::PacketType::kWelcome:
      expect_again(transport::read_welcome(payload), payload);
      break;
    case transport::PacketType::kRefusal:
      expect_again(transport::read_refusal(payload), payload);
      break;
    case transport::PacketType::kBye:
      expect_again(transport::read_bye(payload), payload);
      break;
    case transport::PacketType::kKeepAlive:
      expect_again(transport::read_keep_alive(payload), payload);
      break;
    case transport::PacketType::kOffer:
      expect_again(transport::read_offer(payload), payload);
      break;
    case transport::PacketType::kChunk:
      expect_again(transport::read_chunk(payload), payload);
      break;
    case transport::PacketType::kAcknowledge:
      expect_again(transport::read_acknowledge(payload), payload);
      break;
    case transport::PacketType::kSlaveStatus: {
      codecs::SlaveStatus status;
      if (codecs::read(payload, status) != codecs::Fault::kNone) break;
      demand(is_same(std::span(again).first(codecs::write(status, again)), payload));
      break;
    }
    case transport::PacketType::kTile:
      if (const auto message = codecs::read_tile_message(payload))
        demand(is_same(std::span(again).first(codecs::write(*message, again)), payload));
      break;
    case transport::PacketType::kTileAcknowledge:
      if (const auto message = codecs::read_tile_acknowledge(payload))
        demand(is_same(std::span(again).first(codecs::write(*message, again)), payload));
      break;
    case transport::PacketType::kPoseSample:
      read_pose(payload);
      break;
    case transport::PacketType::kContactSet:
      read_contacts(payload);
      break;
  }
  return 0;
}
