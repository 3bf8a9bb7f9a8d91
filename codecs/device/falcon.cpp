#include "codecs/device/falcon.h"

#include <algorithm>

namespace farfeel::codecs {

namespace {

constexpr std::byte kStart{'<'}, kEnd{'>'};
constexpr unsigned kZero = 'A';

/// 0 to 15; 16 and more: no nibble.
unsigned nibble(std::byte byte) noexcept {
  return std::to_integer<unsigned>(byte) - kZero;
}

}  // namespace

FalconPacket encoded(const FalconCommand& command) noexcept {
  FalconPacket packet;
  packet.fill(std::byte{kZero});
  packet.front() = kStart;
  packet.back() = kEnd;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = static_cast<std::uint16_t>(command.motors[i]);
    for (std::size_t n = 0; n < 4; ++n)
      packet[1 + 4 * i + n] = static_cast<std::byte>(kZero + ((value >> (4 * n)) & 0xfU));
  }
  packet[13] = static_cast<std::byte>(kZero + (command.lights & 0x0eU) + (command.is_homing ? 1U : 0U));
  return packet;
}

std::optional<FalconReading> decoded_falcon_reading(std::span<const std::byte> packet) noexcept {
  if (packet.size() != kFalconPacketBytes || packet.front() != kStart || packet.back() != kEnd) return std::nullopt;
  FalconReading reading;
  for (std::size_t i = 0; i < 3; ++i) {
    unsigned value = 0;
    for (std::size_t n = 0; n < 4; ++n) {
      const unsigned part = nibble(packet[1 + 4 * i + n]);
      if (part > 0xf) return std::nullopt;
      value |= part << (4 * n);
    }
    reading.counts[i] = static_cast<std::int16_t>(static_cast<std::uint16_t>(value));
  }
  const unsigned bits = nibble(packet[13]);
  if (bits > 0x7f) return std::nullopt;
  reading.buttons = static_cast<std::uint8_t>(bits & 0xfU);
  reading.homed = static_cast<std::uint8_t>(bits >> 4U);
  return reading;
}

std::optional<FalconReading> FalconStream::take(std::span<const std::byte> bytes) noexcept {
  std::optional<FalconReading> newest;
  for (const std::byte byte : bytes) {
    if (held_ == 0 && byte != kStart) {
      ++discarded_bytes_;
      continue;
    }
    packet_[held_++] = byte;
    if (held_ < kFalconPacketBytes) continue;
    if (const auto reading = decoded_falcon_reading(packet_)) {
      newest = reading;
      ++readings_;
      held_ = 0;
    } else {
      drop_to_next_start();
    }
  }
  return newest;
}

void FalconStream::drop_to_next_start() noexcept {
  const auto end = packet_.begin() + static_cast<std::ptrdiff_t>(held_);
  const auto next = std::find(packet_.begin() + 1, end, kStart);
  discarded_bytes_ += static_cast<std::uint64_t>(next - packet_.begin());
  std::copy(next, end, packet_.begin());
  held_ = static_cast<std::size_t>(end - next);
}

std::string_view falcon_firmware_trouble(std::span<const std::byte> bytes) noexcept {
  constexpr std::size_t kHeader = 22, kBlockHeader = 6;
  if (bytes.size() > kMostFalconFirmwareBytes) return "is larger than the device's memory";
  if (bytes.size() < kHeader + 2) return "is too short for firmware";
  const auto word = [&](std::size_t at) {
    return std::to_integer<std::size_t>(bytes[at]) | (std::to_integer<std::size_t>(bytes[at + 1]) << 8U);
  };
  if (word(0) != 0x08aa) return "does not begin with aa 08, as firmware for a Falcon does";
  std::size_t at = kHeader;
  while (at + 2 <= bytes.size()) {
    const std::size_t words = word(at);
    if (words == 0) return at + 2 == bytes.size() ? "" : "goes on after its last block";
    at += kBlockHeader + 2 * words;
  }
  return "is cut off";
}

}  // namespace farfeel::codecs
