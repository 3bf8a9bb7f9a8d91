// A side session's requests, to change the scene or to have it as it is now, and the answers to them. PROTOCOL.md has
// the tables.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::codecs {

enum class EditKind : std::uint8_t {
  kStamp = 1,   ///< presses a ball into the surface
  kSpawn = 2,   ///< brings an object that is not there
  kMove = 3,    ///< takes an object elsewhere, on a straight way
  kRemove = 4,  ///< takes it away
  kRevert = 5,  ///< the surface, the place and whether it is there, as in the scene's file
};

/// An edit that is made once, however often its request comes: a key's request of one number is one edit.
struct EditRequest {
  std::uint64_t number = 0;  ///< random, not 0
  EditKind kind = EditKind::kStamp;
  std::string object;                      ///< its name in the scene: 1 to 64 bytes
  glm::dvec3 place_M{0};                   ///< of a stamp, in the mesh's own frame
  double radius_m = 0, depth_m = 0;        ///< of a stamp: > 0, the depth at most the radius
  std::optional<spatial::Pose> X_WM = {};  ///< of a spawn or a move: none is where it is, or where it was last
  double takes_s = 0;                      ///< of a move
};

enum class EditOutcome : std::uint8_t {
  kRefused = 0,
  kDone = 1,      ///< and lost when the slave ends: it keeps nothing
  kToBeKept = 2,  ///< done; not on a disk yet
  kDurable = 3,   ///< done, and made again after whatever happens to the slave
};

struct EditAnswer {
  std::uint64_t number = 0;  ///< of the request
  EditOutcome outcome = EditOutcome::kRefused;
  std::uint32_t version = 0;  ///< of the scene, which holds it from this one on
  std::string words;          ///< what was done, or why it was not: at most 400 bytes
  [[nodiscard]] bool is_done() const { return outcome != EditOutcome::kRefused; }
};

/// What happened last in a scene, told to side sessions whenever it changes and some times a second.
struct SceneNews {
  std::uint32_t version = 0;  ///< 0: nothing has changed
  std::uint32_t durable = 0;  ///< the newest version that is kept over a restart
  std::string words;          ///< at most 400 bytes
};

/// "Give me the scene as it is now": asked again until it is answered.
struct SaveRequest {
  std::uint64_t number = 0;  ///< random, not 0
};

enum class SaveOutcome : std::uint8_t {
  kRefused = 0,
  kOffered = 1,  ///< as an object of that hash, in the slot for it
  kLater = 2,    ///< not now: ask again
};

struct SaveAnswer {
  std::uint64_t number = 0;  ///< of the request
  SaveOutcome outcome = SaveOutcome::kRefused;
  std::uint32_t version = 0;         ///< of the scene that is offered
  std::array<std::byte, 32> hash{};  ///< of the object that holds it; zeros where none is offered
  std::string words;                 ///< why not: at most 400 bytes
};

inline constexpr std::size_t kMostEditName = 64, kMostEditWords = 400;
inline constexpr std::size_t kMostEditBytes = 512;  ///< of any of these
inline constexpr double kMostEditRadius_m = 0.1;

/// The payload's size, or 0 if it does not fit or is not within the limits. Longer words are cut, and what could steer
/// a terminal becomes '?'.
[[nodiscard]] std::size_t write(const EditRequest&, std::span<std::byte> to);
[[nodiscard]] std::size_t write(const EditAnswer&, std::span<std::byte> to);
[[nodiscard]] std::size_t write(const SceneNews&, std::span<std::byte> to);
[[nodiscard]] std::size_t write(const SaveRequest&, std::span<std::byte> to);
[[nodiscard]] std::size_t write(const SaveAnswer&, std::span<std::byte> to);
/// Finite, printable and within the limits; fails on any other length than the layout's own.
[[nodiscard]] std::optional<EditRequest> read_edit_request(std::span<const std::byte> payload);
[[nodiscard]] std::optional<EditAnswer> read_edit_answer(std::span<const std::byte> payload);
[[nodiscard]] std::optional<SceneNews> read_scene_news(std::span<const std::byte> payload);
[[nodiscard]] std::optional<SaveRequest> read_save_request(std::span<const std::byte> payload);
[[nodiscard]] std::optional<SaveAnswer> read_save_answer(std::span<const std::byte> payload);

}  // namespace farfeel::codecs
