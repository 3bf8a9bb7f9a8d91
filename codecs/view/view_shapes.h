// What of a scene the live view draws: each body's mesh, in a scan's colours if it has them, and where its height tiles
// are. Quantised to 16 bits of the body's own box, in the body's frame.
#pragma once

#include <array>

#include "codecs/view/view_messages.h"
#include "haptic_core/geometry/triangle_mesh.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::codecs {

struct ViewScene {
  std::string name;
  std::uint16_t bodies = 0;
  glm::dvec3 p_TWork_T{0}, nhat_work_T{0, 0, -1};  ///< the tool's point that works, and out of the tool there
};

/// A vertex (i, j, k) is at low + step * (i, j, k) [m].
using ViewVertex = std::array<std::uint16_t, 3>;
struct ViewBox {
  glm::dvec3 low_B{0}, step_B{0};
  [[nodiscard]] static ViewBox around(const geometry::Box&);
  /// Off by at most half a step, the box' size / 131,070; what is outside of the box is put on its side.
  [[nodiscard]] ViewVertex vertex(const glm::dvec3& p_B) const;
};

using ViewColour = std::array<std::uint8_t, 3>;  ///< red, green and blue as screens take them (sRGB)

struct ViewBody {
  std::uint16_t index = 0;  ///< 0 the tool; i + 1 the scene's object i
  std::string name;
  spatial::Pose X_WB;  ///< of an object at scene time 0
  ViewBox box;
  std::vector<ViewVertex> vertices;
  std::vector<geometry::Triangle> triangles;
  std::vector<ViewColour> colours;  ///< one a vertex, or none
};
/// A mesh beyond the bounds is left away.
[[nodiscard]] ViewBody view_body(std::uint16_t index, std::string name, const spatial::Pose& X_WB,
                                 const geometry::TriangleMesh& mesh_B, const std::vector<ViewColour>& colours = {});

/// A body's height tiles: the triangles of its felt surface, and of which of the tiles each is.
struct ViewPiece {
  std::array<ViewVertex, 3> corners;
  std::uint32_t tile = 0;  ///< < tiles
};
struct ViewTiles {
  std::uint16_t body = 0;
  ViewBox box;
  std::uint32_t tiles = 0;
  std::vector<ViewPiece> pieces;
};

/// Of all tiles of all bodies, in the order in which they were told: whether the tile's heights are here.
struct ViewPresence {
  std::vector<bool> is_here;
};

[[nodiscard]] std::vector<std::byte> write_view(const ViewScene&);
[[nodiscard]] std::vector<std::byte> write_view(const ViewBody&);
[[nodiscard]] std::vector<std::byte> write_view(const ViewTiles&);
[[nodiscard]] std::vector<std::byte> write_view(const ViewPresence&);

/// Nothing where a byte is missing, too many, or out of its range.
[[nodiscard]] std::optional<ViewScene> read_view_scene(std::span<const std::byte>);
[[nodiscard]] std::optional<ViewBody> read_view_body(std::span<const std::byte>);
[[nodiscard]] std::optional<ViewTiles> read_view_tiles(std::span<const std::byte>);
[[nodiscard]] std::optional<ViewPresence> read_view_presence(std::span<const std::byte>);

}  // namespace farfeel::codecs
