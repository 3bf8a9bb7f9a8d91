// What a session shows of itself: from the master to `farfeel view` and on to its page, and what these ask of the
// master.
//
// A message is a version, a kind and a body, little-endian. Over a stream its length comes first (message_stream.h);
// over WebSocket it is one binary message. The page reads the same bytes (master_station/view/page/messages.js).
// Every count has a bound that is checked before memory is taken, and every length is exact.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"
#include "haptic_core/local_model/pushes.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::codecs {

inline constexpr std::uint8_t kViewVersion = 1;

enum class ViewKind : std::uint8_t {
  kScene = 1,    ///< its name, and how many bodies follow
  kBody = 2,     ///< one mesh: the tool, then the objects
  kTick = 3,     ///< the newest tick, and what was between it and the one told before
  kStatus = 4,   ///< words: what happened, what to do, link, node, session, device
  kControl = 5,  ///< asks the master for something
  kToken = 6,    ///< page to view, once, before all else
  kTaken = 7,    ///< page to view: a tick was shown, another may come
};

// Bounds, checked by writers and readers.
inline constexpr std::size_t kMostViewBodies = 257;           ///< the tool and a scene's objects
inline constexpr std::size_t kMostViewVertices = 4'000'000;   ///< of one body; 64 MB with its triangles
inline constexpr std::size_t kMostViewTriangles = 4'000'000;  ///< the same
inline constexpr std::size_t kMostViewMoving = 256;           ///< objects that move by a script
inline constexpr std::size_t kMostViewWords = 32;             ///< lines of a status
inline constexpr std::size_t kMostViewText = 1024;            ///< bytes of one text
inline constexpr std::size_t kMostViewBytes = 80'000'000;     ///< of any message
inline constexpr std::size_t kMostViewRequestBytes = 256;     ///< of a message towards the master
inline constexpr std::size_t kViewTokenBytes = 32;            ///< 128 random bits, written in hexadecimal

struct ViewScene {
  std::string name;
  std::uint16_t bodies = 0;
};

/// A mesh, quantised to 16 bits of its own box.
struct ViewBody {
  std::uint16_t index = 0;  ///< 0 the tool; i + 1 the scene's object i
  std::string name;
  spatial::Pose X_WB;              ///< of an object at scene time 0
  glm::dvec3 low_B{0}, step_B{0};  ///< a vertex is low + step * (i, j, k) [m]
  std::vector<std::array<std::uint16_t, 3>> vertices;
  std::vector<geometry::Triangle> triangles;
};
/// Vertices are off by at most half a step, the box' size / 131,070.
[[nodiscard]] ViewBody view_body(std::uint16_t index, std::string name, const spatial::Pose& X_WB,
                                 const geometry::TriangleMesh& mesh_B);

/// What is drawn over time, in this order.
enum class ViewSeries : std::uint8_t {
  kForce_N,
  kTorque_Nm,
  kDepth_m,
  kTank_J,
  kCoupling_J,
  kContacts_J,
  kWork_us,
  kRoundTrip_ms,
  kNetwork_ms,
  kNode_ms,
  kAge_ms,
};
inline constexpr std::size_t kViewSeries = 11;

/// A quantity over some ticks; none of them had it: count is 0 and the rest NaN.
struct ViewBin {
  float low = std::numeric_limits<float>::quiet_NaN(), high = low, mean = low;
  std::uint32_t count = 0;
  void add(double value) noexcept;
  void add(const ViewBin&) noexcept;
};

struct ViewTick {
  static constexpr std::uint8_t kResting = 1u << 0;        ///< of flags: tiles rest
  std::uint64_t number = 0;                                ///< of the tick
  std::int64_t time_ns = 0;                                ///< since the loop started
  std::int64_t told_ns = 0;                                ///< CLOCK_MONOTONIC when the recorder had it
  std::uint8_t state = 0, fault = 0, rung = 0, flags = 0;  ///< master_station's LoopState and Fault
  spatial::Pose X_WT, X_WI;
  spatial::Wrench F_hand_W, F_contact_To_W;
  double depth_max_m = 0;
  std::uint32_t pressing = 0;
  local_model::Pushes pushes;
  std::vector<std::pair<std::uint16_t, spatial::Pose>> moving;  ///< bodies that move by a script, where they are
  std::uint32_t ticks = 0;                                      ///< that the bins are of
  std::array<ViewBin, kViewSeries> bins;

  /// The same tick, and the bins of one that came before it and was not told.
  void absorb(const ViewTick& earlier) noexcept;
};

struct ViewStatus {
  bool is_trouble = false;
  std::string happened, to_do;                             ///< of the loop's state or its fault, for a person
  std::vector<std::pair<std::string, std::string>> words;  ///< link, node, session, device
};

/// What may be asked of a master. None of it gives force: the device's own grip does.
enum class ViewVerb : std::uint8_t { kResetFault = 1 };

[[nodiscard]] std::vector<std::byte> write_view(const ViewScene&);
[[nodiscard]] std::vector<std::byte> write_view(const ViewBody&);
[[nodiscard]] std::vector<std::byte> write_view(const ViewTick&);
[[nodiscard]] std::vector<std::byte> write_view(const ViewStatus&);
[[nodiscard]] std::vector<std::byte> write_view(ViewVerb);
[[nodiscard]] std::vector<std::byte> write_view_token(const std::string& token);
[[nodiscard]] std::vector<std::byte> write_view_taken(std::uint64_t number);

/// Nothing where it is no message of this version.
[[nodiscard]] std::optional<ViewKind> kind_of_view(std::span<const std::byte>) noexcept;
/// Nothing where a byte is missing, too many, or out of its range.
[[nodiscard]] std::optional<ViewScene> read_view_scene(std::span<const std::byte>);
[[nodiscard]] std::optional<ViewBody> read_view_body(std::span<const std::byte>);
[[nodiscard]] std::optional<ViewTick> read_view_tick(std::span<const std::byte>);
[[nodiscard]] std::optional<ViewStatus> read_view_status(std::span<const std::byte>);
[[nodiscard]] std::optional<ViewVerb> read_view_control(std::span<const std::byte>) noexcept;
[[nodiscard]] std::optional<std::string> read_view_token(std::span<const std::byte>);
[[nodiscard]] std::optional<std::uint64_t> read_view_taken(std::span<const std::byte>) noexcept;

}  // namespace farfeel::codecs
