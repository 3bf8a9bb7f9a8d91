// What a Novint Falcon and its computer say to each other once its firmware runs, and the file of that firmware.
//
// A packet of 16 bytes each way, the device's in answer to the computer's:
//
//     '<'  m m m m  m m m m  m m m m  s  x  '>'
//
// m: one of the four nibbles of an int16, the lowest first, as 'A' + nibble: motor values out, encoder counts in, of
// the arms at the top, right and left as seen from the person. s is 'A' + bits: out, 0x01 asks for homing, 0x02, 0x04,
// 0x08 are lights; in, 0x01 to 0x08 are the grip's buttons and 0x10 to 0x40 say which arm knows its place. x is 'A' out
// and unknown in. Source: libnifalcon's documents and code; where they disagree (homing bit, colours) its code counts,
// which is what has met hardware. There is no checksum: what a flipped nibble does must be caught by who reads counts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace farfeel::codecs {

inline constexpr std::size_t kFalconPacketBytes = 16;
using FalconPacket = std::array<std::byte, kFalconPacketBytes>;

inline constexpr std::uint8_t kFalconGreen = 0x02, kFalconBlue = 0x04, kFalconRed = 0x08;  ///< lights

struct FalconCommand {
  std::array<std::int16_t, 3> motors{};  ///< positive turns an arm back to the base
  std::uint8_t lights = 0;
  bool is_homing = true;  ///< in every packet, or the device forgets its home
};

struct FalconReading {
  std::array<std::int16_t, 3> counts{};  ///< of the encoders; means a place only where the arm is homed
  std::uint8_t buttons = 0;              ///< bit 0 right (+), 1 forward, 2 middle, 3 left (-)
  std::uint8_t homed = 0;                ///< bit i: arm i

  [[nodiscard]] bool is_homed() const noexcept { return homed == 7; }
  friend bool operator==(const FalconReading&, const FalconReading&) = default;
};

[[nodiscard]] FalconPacket encoded(const FalconCommand&) noexcept;
/// Exactly 16 bytes in the form above, or nothing.
[[nodiscard]] std::optional<FalconReading> decoded_falcon_reading(std::span<const std::byte> packet) noexcept;

/// Finds readings in a stream of bytes that may be split, merged or broken anywhere. A '<' occurs nowhere inside a good
/// packet but in x, so after anything else it goes on at the next '<'. Bounded memory; no allocation.
class FalconStream {
 public:
  /// Takes over bytes (without modem status); the newest reading that ended in them.
  [[nodiscard]] std::optional<FalconReading> take(std::span<const std::byte> bytes) noexcept;
  void forget() noexcept { held_ = 0; }  ///< what is not whole yet

  [[nodiscard]] std::uint64_t readings() const noexcept { return readings_; }
  [[nodiscard]] std::uint64_t discarded_bytes() const noexcept { return discarded_bytes_; }

 private:
  void drop_to_next_start() noexcept;

  FalconPacket packet_{};
  std::size_t held_ = 0;  // bytes of packet_, the first of them '<'
  std::uint64_t readings_ = 0, discarded_bytes_ = 0;
};

/// Why bytes are no firmware; empty: they are. The boot loader of the Falcon's processor (Texas Instruments C2000,
/// SPRU095) takes 16-bit words, low byte first: key 0x08aa, 8 reserved, an entry point, blocks of a size, an address
/// and so many words, and a size of 0 at the end. A file that ends otherwise would leave the device waiting.
[[nodiscard]] std::string_view falcon_firmware_trouble(std::span<const std::byte> bytes) noexcept;

/// More than the processor has memory for (128 Ki words).
inline constexpr std::size_t kMostFalconFirmwareBytes = 262'144;

}  // namespace farfeel::codecs
