// FTDI's USB to serial chip (FT232 and its kin) as bytes: a vendor's control requests, and the two bytes of modem
// status that begin each packet of a bulk IN transfer. Sources: FTDI's application note AN232B-04, Linux's ftdi_sio.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace farfeel::codecs {

/// A control request without data. Type 0x40: a vendor's, to the device.
struct FtdiRequest {
  std::uint8_t request = 0;
  std::uint16_t value = 0;
};

inline constexpr std::uint8_t kFtdiRequestType = 0x40;
inline constexpr FtdiRequest kFtdiPurgeReceived{0, 1}, kFtdiPurgeToSend{0, 2};
inline constexpr FtdiRequest kFtdiDtrLow{1, 0x0100}, kFtdiDtrHigh{1, 0x0101}, kFtdiRtsLow{1, 0x0200};
inline constexpr FtdiRequest kFtdiNoFlowControl{2, 0};
inline constexpr FtdiRequest kFtdiEightBitsNoParity{4, 8};
/// The divisor as the chip takes it: 0x4138 is 9600 baud.
[[nodiscard]] constexpr FtdiRequest ftdi_baud(std::uint16_t divisor) noexcept {
  return {3, divisor};
}
/// How long the chip waits for more before it sends a packet that is not full [ms]; 1 to 255.
[[nodiscard]] constexpr FtdiRequest ftdi_latency_ms(std::uint8_t ms) noexcept {
  return {9, ms};
}

inline constexpr std::size_t kFtdiPacketBytes = 64;  ///< of full-speed chips
inline constexpr std::size_t kFtdiStatusBytes = 2;

/// The payload of one whole IN transfer, its status bytes left out, into `payload`: how many bytes. What does not fit
/// is dropped. The transfer must be whole: packets are told by their place in it alone.
[[nodiscard]] std::size_t ftdi_payload(std::span<const std::byte> transfer, std::span<std::byte> payload) noexcept;

}  // namespace farfeel::codecs
