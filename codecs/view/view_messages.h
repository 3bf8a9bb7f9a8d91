// What a session shows of itself: from the master to `farfeel view` and on to its page, and what these ask of the
// master. Here the kinds, their bounds, and all that is words; bodies and their tiles in view_shapes.h, ticks in
// view_tick.h.
//
// A message is a version, a kind and a body, little-endian. Over a stream its length comes first (message_stream.h);
// over WebSocket it is one binary message. The page reads the same bytes (master_station/view/page/messages.js).
// Every count has a bound that is checked before memory is taken, and every length is exact.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace farfeel::codecs {

inline constexpr std::uint8_t kViewVersion = 4;

enum class ViewKind : std::uint8_t {
  kScene = 1,      ///< its name, and how many bodies follow
  kBody = 2,       ///< one mesh: the tool, then the objects
  kTick = 3,       ///< the newest tick, and what was between it and the one told before
  kStatus = 4,     ///< words: what happened, what to do, link, node, session, device
  kControl = 5,    ///< asks the master for something
  kToken = 6,      ///< page to view, once, before all else
  kTaken = 7,      ///< page to view: a tick was shown, another may come
  kAnswer = 8,     ///< what came of what was asked
  kTiles = 9,      ///< where a body's height tiles are
  kPresence = 10,  ///< which of all of them are here
  kHistory = 11,   ///< view to page, once: what was between the last ticks
};

// Bounds, checked by writers and readers.
inline constexpr std::size_t kMostViewBodies = 257;           ///< the tool and a scene's objects
inline constexpr std::size_t kMostViewVertices = 4'000'000;   ///< of one body; 84 MB with its triangles and colours
inline constexpr std::size_t kMostViewTriangles = 4'000'000;  ///< the same
inline constexpr std::size_t kMostViewTiles = 65'536;         ///< of all bodies
inline constexpr std::size_t kMostViewPieces = 1'000'000;     ///< triangles that show tiles, of all bodies
inline constexpr std::size_t kMostViewMoving = 256;           ///< objects that move, or come and go
inline constexpr std::size_t kMostViewMoments = 1'024;        ///< of a history
inline constexpr std::size_t kMostViewWords = 32;             ///< lines of a status
inline constexpr std::size_t kMostViewText = 1024;            ///< bytes of one text
inline constexpr std::size_t kMostViewBytes = 90'000'000;     ///< of any message
inline constexpr std::size_t kMostViewRequestBytes = 256;     ///< of a message towards the master
inline constexpr std::size_t kViewTokenBytes = 32;            ///< 128 random bits, written in hexadecimal

enum class ViewTone : std::uint8_t { kQuiet, kNotice, kTrouble };

struct ViewStatus {
  ViewTone tone = ViewTone::kQuiet;
  bool is_paused = false;
  std::string happened, to_do;                             ///< of the loop's state or its fault, for a person
  std::vector<std::pair<std::string, std::string>> words;  ///< link, node, session, device
};

/// What may be asked of a master. None of it gives force: the device's own grip does.
enum class ViewVerb : std::uint8_t { kResetFault = 1, kPause = 2, kResume = 3, kRecentre = 4 };

/// To whoever asked, in words: what is done now, or why it is not.
struct ViewAnswer {
  ViewVerb verb = ViewVerb::kResetFault;
  bool is_done = false;
  std::string words;
};

[[nodiscard]] std::vector<std::byte> write_view(const ViewStatus&);
[[nodiscard]] std::vector<std::byte> write_view(ViewVerb);
[[nodiscard]] std::vector<std::byte> write_view(const ViewAnswer&);
[[nodiscard]] std::vector<std::byte> write_view_token(const std::string& token);
[[nodiscard]] std::vector<std::byte> write_view_taken(std::uint64_t number);

/// Nothing where it is no message of this version.
[[nodiscard]] std::optional<ViewKind> kind_of_view(std::span<const std::byte>) noexcept;
/// Nothing where a byte is missing, too many, or out of its range.
[[nodiscard]] std::optional<ViewStatus> read_view_status(std::span<const std::byte>);
[[nodiscard]] std::optional<ViewVerb> read_view_control(std::span<const std::byte>) noexcept;
[[nodiscard]] std::optional<ViewAnswer> read_view_answer(std::span<const std::byte>);
[[nodiscard]] std::optional<std::string> read_view_token(std::span<const std::byte>);
[[nodiscard]] std::optional<std::uint64_t> read_view_taken(std::span<const std::byte>) noexcept;

}  // namespace farfeel::codecs
