// What the sealed datagrams of the two lanes carry: the first byte of what is sealed. PROTOCOL.md has each one's table.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace farfeel::transport {

/// Where a slave listens unless told otherwise: both lanes.
inline constexpr std::uint16_t kDefaultPort = 47000;

enum class MessageType : std::uint8_t {
  kBye = 1,              ///< bulk lane, either way
  kKeepAlive = 2,        ///< either lane, either way: empty
  kChallenge = 3,        ///< either lane, slave -> master: prove that you are at this address
  kChallengeAnswer = 4,  ///< either lane, master -> slave: the same eight bytes
  kSlaveStatus = 9,      ///< bulk lane, slave -> master
  kTileRequest = 10,     ///< bulk lane, master -> slave: send height tiles
  kEditRequest = 11,     ///< side session, to the slave: change the scene
  kEditAnswer = 12,      ///< side session, from the slave: what became of it
  kSceneNews = 13,       ///< side session, from the slave: what happened last in the scene
  kSaveRequest = 14,     ///< side session, to the slave: give the scene as it is now
  kSaveAnswer = 15,      ///< side session, from the slave: which object that is, or why not
  kPoseSample = 16,      ///< haptic lane, master -> slave
  kContactSet = 17,      ///< haptic lane, slave -> master
  kTilesHeld = 18,       ///< bulk lane, master -> slave: height tiles that it has, from a session before
  kTile = 0x2A,          ///< bulk lane, slave -> master: a part of a height tile; 0x20 - 0x2F: bulk/bulk_messages.h
  kCourse = 0x2B,        ///< bulk lane, slave -> master: what an object does from a scene time on
};

/// One authentic message. The payload points into the datagram that it came in.
struct Message {
  MessageType type{};
  std::span<const std::byte> payload;
  bool is_newest = false;  ///< nothing newer came before it on its lane
};

[[nodiscard]] std::string_view name_of(MessageType) noexcept;  ///< empty for a number that is none

}  // namespace farfeel::transport
