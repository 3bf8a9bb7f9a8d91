// The payloads of the bulk lane that a session itself reads. PROTOCOL.md has each one's table; bulk/bulk_messages.h
// has those that move objects and what else is paced.
//
// write() returns the payload's bytes within `to`; read() fails on any other length than the layout's own and on values
// out of range. Neither allocates nor throws.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "transport/lane/lane_keys.h"
#include "transport/message.h"

namespace farfeel::transport {

using PayloadBuffer = std::array<std::byte, kMaxMessageBytes>;

/// Where the scene stands among the bulk lane's objects, and how urgent it is beside what else is sent there.
inline constexpr std::uint32_t kSceneSlot = 0;
inline constexpr std::uint8_t kSceneUrgency = 0;
/// Where a side session gets the scene as files, when it asked for them.
inline constexpr std::uint32_t kSavedSlot = 1;

enum class ByeReason : std::uint8_t {
  kDone = 1,
  kRevoked = 2,
  kDisbelieved = 3,  ///< the other end has acknowledged what was never sent to it
};
struct Bye {
  ByeReason reason{};
};

[[nodiscard]] std::span<const std::byte> write(const Bye&, PayloadBuffer& to) noexcept;

[[nodiscard]] std::optional<Bye> read_bye(std::span<const std::byte> payload) noexcept;

}  // namespace farfeel::transport
