#include "codecs/view/view_shapes.h"

#include <algorithm>
#include <cmath>

#include "codecs/view/view_bytes.h"

namespace farfeel::codecs {
namespace {

constexpr double kQuantised = 65535;  // steps across a box
constexpr std::size_t kVertexBytes = 6, kTriangleBytes = 12, kPieceBytes = 3 * kVertexBytes + 4,
                      kColourBytes = sizeof(ViewColour);

void write(ViewMessage& message, const ViewBox& box) {
  message.write(box.low_B);
  message.write(box.step_B);
}

ViewBox read_box(ViewReader& in) {
  ViewBox box;
  box.low_B = in.vec3();
  box.step_B = in.vec3();
  return box;
}

void read(ViewReader& in, ViewVertex& vertex) {
  for (std::uint16_t& coordinate : vertex) coordinate = in.from.u16();
}

}  // namespace

ViewBox ViewBox::around(const geometry::Box& box) {
  return {box.low, box.size() / kQuantised};
}

ViewVertex ViewBox::vertex(const glm::dvec3& p_B) const {
  ViewVertex vertex{};
  for (int i = 0; i < 3; ++i) {
    const double at = step_B[i] > 0 ? (p_B[i] - low_B[i]) / step_B[i] : 0;
    vertex[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(std::clamp(std::round(at), 0.0, kQuantised));
  }
  return vertex;
}

ViewBody view_body(std::uint16_t index, std::string name, const spatial::Pose& X_WB,
                   const geometry::TriangleMesh& mesh_B, const std::vector<ViewColour>& colours) {
  ViewBody body{index, std::move(name), X_WB, {}, {}, {}, {}};
  if (mesh_B.positions_O.empty() || mesh_B.positions_O.size() > kMostViewVertices ||
      mesh_B.triangles.size() > kMostViewTriangles)
    return body;
  body.box = ViewBox::around(geometry::bounding_box(mesh_B));
  body.vertices.reserve(mesh_B.positions_O.size());
  for (const glm::dvec3& p : mesh_B.positions_O) body.vertices.push_back(body.box.vertex(p));
  body.triangles = mesh_B.triangles;
  body.colours = colours;
  return body;
}

std::vector<std::byte> write_view(const ViewScene& scene) {
  ViewMessage message(ViewKind::kScene, 64 + kMostViewText);
  message.write(scene.name);
  message.to.u16(scene.bodies);
  message.write(scene.p_TWork_T);
  message.write(scene.nhat_work_T);
  return message.taken();
}

std::vector<std::byte> write_view(const ViewBody& body) {
  ViewMessage message(ViewKind::kBody, 256 + kMostViewText + kVertexBytes * body.vertices.size() +
                                           kTriangleBytes * body.triangles.size() + kColourBytes * body.colours.size());
  message.to.u16(body.index);
  message.write(body.name);
  message.write(body.X_WB);
  write(message, body.box);
  message.to.u32(static_cast<std::uint32_t>(body.vertices.size()));
  message.to.u32(static_cast<std::uint32_t>(body.triangles.size()));
  message.to.u32(static_cast<std::uint32_t>(body.colours.size()));
  message.to.bytes(std::as_bytes(std::span(body.vertices)));
  message.to.bytes(std::as_bytes(std::span(body.triangles)));
  message.to.bytes(std::as_bytes(std::span(body.colours)));
  return message.taken();
}

std::vector<std::byte> write_view(const ViewTiles& tiles) {
  ViewMessage message(ViewKind::kTiles, 64 + kPieceBytes * tiles.pieces.size());
  message.to.u16(tiles.body);
  write(message, tiles.box);
  message.to.u32(tiles.tiles);
  message.to.u32(static_cast<std::uint32_t>(tiles.pieces.size()));
  for (const ViewPiece& piece : tiles.pieces) {
    message.to.u32(piece.tile);
    message.to.bytes(std::as_bytes(std::span(piece.corners)));
  }
  return message.taken();
}

std::vector<std::byte> write_view(const ViewPresence& presence) {
  ViewMessage message(ViewKind::kPresence, 8 + presence.is_here.size() / 8 + 1);
  message.to.u32(static_cast<std::uint32_t>(presence.is_here.size()));
  for (std::size_t i = 0; i < presence.is_here.size(); i += 8) {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 8 && i + k < presence.is_here.size(); ++k)
      bits |= unsigned{presence.is_here[i + k]} << k;
    message.to.u8(static_cast<std::uint8_t>(bits));
  }
  return message.taken();
}

std::optional<ViewScene> read_view_scene(std::span<const std::byte> message) {
  ViewReader in(message, ViewKind::kScene);
  ViewScene scene;
  scene.name = in.text();
  scene.bodies = in.at_most(in.from.u16(), kMostViewBodies);
  scene.p_TWork_T = in.vec3();
  scene.nhat_work_T = in.vec3();
  return in.is_whole() ? std::optional(std::move(scene)) : std::nullopt;
}

std::optional<ViewBody> read_view_body(std::span<const std::byte> message) {
  ViewReader in(message, ViewKind::kBody);
  ViewBody body;
  body.index = in.at_most(in.from.u16(), kMostViewBodies - 1);
  body.name = in.text();
  body.X_WB = in.pose();
  body.box = read_box(in);
  const std::size_t vertices = in.at_most(in.from.u32(), kMostViewVertices);
  const std::size_t triangles = in.at_most(in.from.u32(), kMostViewTriangles);
  const std::size_t colours = in.at_most(in.from.u32(), kMostViewVertices);
  in.demand(colours == 0 || colours == vertices);
  if (!in.is_right() ||
      in.from.remaining() != kVertexBytes * vertices + kTriangleBytes * triangles + kColourBytes * colours)
    return std::nullopt;
  body.vertices.resize(vertices);
  for (ViewVertex& vertex : body.vertices) read(in, vertex);
  body.triangles.resize(triangles);
  for (geometry::Triangle& triangle : body.triangles) {
    for (std::uint32_t& corner : triangle) {
      corner = in.from.u32();
      in.demand(corner < vertices);
    }
  }
  body.colours.resize(colours);
  for (ViewColour& colour : body.colours)
    for (std::uint8_t& channel : colour) channel = in.from.u8();
  return in.is_whole() ? std::optional(std::move(body)) : std::nullopt;
}

std::optional<ViewTiles> read_view_tiles(std::span<const std::byte> message) {
  ViewReader in(message, ViewKind::kTiles);
  ViewTiles tiles;
  tiles.body = in.at_most(in.from.u16(), kMostViewBodies - 1);
  tiles.box = read_box(in);
  tiles.tiles = in.at_most(in.from.u32(), kMostViewTiles);
  const std::size_t pieces = in.at_most(in.from.u32(), kMostViewPieces);
  if (!in.is_right() || in.from.remaining() != kPieceBytes * pieces) return std::nullopt;
  tiles.pieces.resize(pieces);
  for (ViewPiece& piece : tiles.pieces) {
    piece.tile = in.from.u32();
    in.demand(piece.tile < tiles.tiles);
    for (ViewVertex& corner : piece.corners) read(in, corner);
  }
  return in.is_whole() ? std::optional(std::move(tiles)) : std::nullopt;
}

std::optional<ViewPresence> read_view_presence(std::span<const std::byte> message) {
  ViewReader in(message, ViewKind::kPresence);
  ViewPresence presence;
  const std::size_t tiles = in.at_most(in.from.u32(), kMostViewTiles);
  if (!in.is_right() || in.from.remaining() != (tiles + 7) / 8) return std::nullopt;
  presence.is_here.resize(tiles);
  for (std::size_t i = 0; i < tiles; i += 8) {
    const unsigned bits = in.from.u8();
    for (std::size_t k = 0; k < 8 && i + k < tiles; ++k) presence.is_here[i + k] = (bits >> k & 1U) != 0;
    if (tiles - i < 8) in.demand(bits >> (tiles - i) == 0);
  }
  return in.is_whole() ? std::optional(std::move(presence)) : std::nullopt;
}

}  // namespace farfeel::codecs
