#include "transport/seal/handshake.h"

#include <cstdlib>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
namespace {

constexpr std::size_t kInitiationPayloadBytes = 88;
constexpr std::size_t kResponsePayloadBytes = 40;
constexpr std::size_t kInitiationHeadBytes = 8;
constexpr std::size_t kResponseHeadBytes = 12;
static_assert(kInitiationHeadBytes + kNoiseFirstBytes + kInitiationPayloadBytes + 2 * kMacBytes == kInitiationBytes);
static_assert(kResponseHeadBytes + kNoiseSecondBytes + kResponsePayloadBytes + 2 * kMacBytes == kResponseBytes);

std::span<std::byte> initiation_noise(std::span<std::byte, kInitiationBytes> d) {
  return d.subspan(kInitiationHeadBytes, kNoiseFirstBytes + kInitiationPayloadBytes);
}
std::span<std::byte> response_noise(std::span<std::byte, kResponseBytes> d) {
  return d.subspan(kResponseHeadBytes, kNoiseSecondBytes + kResponsePayloadBytes);
}

void write_common(ByteWriter& w, DatagramType type, Suite suite, LaneKind lane) {
  w.u8(static_cast<std::uint8_t>(type));
  w.u8(kLinkVersion);
  w.u8(static_cast<std::uint8_t>(suite));
  w.u8(static_cast<std::uint8_t>(lane));
}

using Prologue = std::array<std::byte, 13>;
Prologue prologue_of(Suite suite, LaneKind lane) {
  Prologue prologue;
  ByteWriter w(prologue);
  constexpr char name[] = {'f', 'a', 'r', 'f', 'e', 'e', 'l', ' ', '3'};
  w.bytes(std::as_bytes(std::span(name)));
  write_common(w, DatagramType::kInitiation, suite, lane);
  return prologue;
}

}  // namespace

InitiatorHandshake::InitiatorHandshake(Suite suite, LaneKind lane, std::uint32_t sender_index, const KeyPair& own,
                                       const Key32& remote_public, const Key32& psk) noexcept
    : noise_(suite, prologue_of(suite, lane), own, remote_public, psk),
      remote_mac1_key_(mac1_key_of(remote_public)),
      sender_index_(sender_index),
      suite_(suite),
      lane_(lane) {}

bool InitiatorHandshake::write_initiation(const InitiationPayload& payload,
                                          std::span<std::byte, kInitiationBytes> out) noexcept {
  std::array<std::byte, kInitiationPayloadBytes> plain;
  ByteWriter p(plain);
  p.u64(payload.counter);
  p.u64(payload.master);
  p.i64(payload.wall_clock_ns);
  p.u32(sender_index_);
  p.u32(payload.session);
  p.pad_to(plain.size());
  ByteWriter w(out);
  write_common(w, DatagramType::kInitiation, suite_, lane_);
  w.u32(sender_index_);
  if (noise_.write_first(plain, initiation_noise(out)) == 0) return false;
  write_mac1(remote_mac1_key_, out);
  return true;
}

std::optional<Response> InitiatorHandshake::read_response(std::span<const std::byte> datagram) noexcept {
  if (datagram.size() != kResponseBytes) return std::nullopt;
  ByteReader head(datagram);
  const bool is_for_us = head.u8() == static_cast<std::uint8_t>(DatagramType::kResponse) && head.u8() == kLinkVersion &&
                         head.u8() == static_cast<std::uint8_t>(suite_) &&
                         head.u8() == static_cast<std::uint8_t>(lane_);
  const std::uint32_t sender_index = head.u32(), receiver_index = head.u32();
  if (!is_for_us || receiver_index != sender_index_) return std::nullopt;

  // A copy, because what is sealed by the slave's key can still be wrong, and must not use this handshake up.
  NoiseInitiator noise = noise_;
  std::array<std::byte, kResponsePayloadBytes> plain;
  auto keys = noise.read_second(head.bytes(kNoiseSecondBytes + kResponsePayloadBytes), plain);
  if (!keys) return std::nullopt;
  Response response;
  ByteReader p(plain);
  response.payload.epoch = p.u64();
  response.payload.session = p.u32();
  const std::uint8_t verdict = p.u8();
  (void)p.bytes(3);
  response.payload.wall_clock_ns = p.i64();
  const bool are_indices_right = p.u32() == sender_index && p.u32() == sender_index_;
  if (!are_indices_right || verdict > static_cast<std::uint8_t>(Verdict::kNotAllowed)) return std::nullopt;
  response.payload.verdict = static_cast<Verdict>(verdict);
  response.sender_index = sender_index;
  response.keys = *keys;
  noise_ = noise;
  return response;
}

ResponderHandshake::ResponderHandshake(const InitiationHead& head, const KeyPair& own) noexcept
    : head_(head), noise_(head.suite, prologue_of(head.suite, head.lane), own) {}

std::optional<Initiation> ResponderHandshake::read_initiation(std::span<const std::byte> datagram) noexcept {
  if (datagram.size() != kInitiationBytes) return std::nullopt;
  std::array<std::byte, kInitiationPayloadBytes> plain;
  const auto sender =
      noise_.read_first(datagram.subspan(kInitiationHeadBytes, kNoiseFirstBytes + kInitiationPayloadBytes), plain);
  if (!sender) return std::nullopt;
  Initiation initiation;
  initiation.sender = initiator_ = *sender;
  ByteReader p(plain);
  initiation.payload.counter = p.u64();
  initiation.payload.master = p.u64();
  initiation.payload.wall_clock_ns = p.i64();
  if (p.u32() != head_.sender_index) return std::nullopt;
  initiation.payload.session = p.u32();
  return initiation;
}

SplitKeys ResponderHandshake::write_response(std::uint32_t sender_index, const Key32& psk,
                                             const ResponsePayload& payload,
                                             std::span<std::byte, kResponseBytes> out) noexcept {
  std::array<std::byte, kResponsePayloadBytes> plain;
  ByteWriter p(plain);
  p.u64(payload.epoch);
  p.u32(payload.session);
  p.u8(static_cast<std::uint8_t>(payload.verdict));
  p.pad_to(16);
  p.i64(payload.wall_clock_ns);
  p.u32(sender_index);
  p.u32(head_.sender_index);
  p.pad_to(plain.size());
  ByteWriter w(out);
  write_common(w, DatagramType::kResponse, head_.suite, head_.lane);
  w.u32(sender_index);
  w.u32(head_.sender_index);
  const SplitKeys keys = noise_.write_second(psk, plain, response_noise(out));
  write_mac1(mac1_key_of(initiator_), out);
  return keys;
}

}  // namespace farfeel::transport
