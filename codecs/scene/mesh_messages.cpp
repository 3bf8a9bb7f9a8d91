#include "codecs/scene/mesh_messages.h"

#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {
namespace {

using transport::ByteReader;
using transport::ByteWriter;

constexpr std::size_t kCodedCountBytes = 8, kDecodedCountBytes = 12;
constexpr std::size_t kVertexBytes = 12, kTriangleBytes = 12, kColourBytes = sizeof(Colour);

/// Of a mesh with so many triangles; more would be used by none.
std::uint64_t most_vertices(const CodedMesh& mesh) {
  return 3 * std::uint64_t{mesh.triangles};
}

tl::unexpected<std::string> unfit(const char* why) {
  return tl::unexpected(std::string("the process that decodes answered with ") + why);
}

}  // namespace

std::vector<std::byte> write_coded(std::span<const CodedMesh> meshes) {
  std::size_t size = 4;
  for (const CodedMesh& mesh : meshes) size += kCodedCountBytes + mesh.bitstream.size();
  std::vector<std::byte> bytes(size);
  ByteWriter w(bytes);
  w.u32(static_cast<std::uint32_t>(meshes.size()));
  for (const CodedMesh& mesh : meshes) {
    w.u32(mesh.triangles);
    w.u32(static_cast<std::uint32_t>(mesh.bitstream.size()));
    w.bytes(mesh.bitstream);
  }
  return bytes;
}

std::optional<std::vector<CodedMesh>> read_coded(std::span<const std::byte> bytes) {
  ByteReader r(bytes);
  const std::size_t count = r.u32();
  if (count > bytes.size() / kCodedCountBytes) return std::nullopt;
  std::vector<CodedMesh> meshes(count);
  for (CodedMesh& mesh : meshes) {
    mesh.triangles = r.u32();
    mesh.bitstream = r.bytes(r.u32());
  }
  if (!r.is_at_end() || fault_of(meshes)) return std::nullopt;
  return meshes;
}

std::vector<std::byte> write_decoded(std::span<const ColouredMesh> meshes) {
  std::size_t size = 0;
  for (const ColouredMesh& mesh : meshes)
    size += kDecodedCountBytes + kVertexBytes * mesh.positions_O.size() + kTriangleBytes * mesh.triangles.size() +
            kColourBytes * mesh.colours.size();
  std::vector<std::byte> bytes(size);
  ByteWriter w(bytes);
  for (const ColouredMesh& mesh : meshes) {
    w.u32(static_cast<std::uint32_t>(mesh.positions_O.size()));
    w.u32(static_cast<std::uint32_t>(mesh.triangles.size()));
    w.u32(static_cast<std::uint32_t>(mesh.colours.size()));
    for (const glm::dvec3& p : mesh.positions_O)
      for (int i = 0; i < 3; ++i) w.f32(p[i]);
    for (const geometry::Triangle& triangle : mesh.triangles)
      for (const std::uint32_t index : triangle) w.u32(index);
    w.bytes(std::as_bytes(std::span(mesh.colours)));
  }
  return bytes;
}

DecodedMeshes read_decoded(std::span<const std::byte> bytes, std::span<const CodedMesh> coded) {
  ByteReader r(bytes);
  std::vector<ColouredMesh> meshes(coded.size());
  for (std::size_t k = 0; k < coded.size(); ++k) {
    const std::uint64_t vertices = r.u32(), triangles = r.u32(), colours = r.u32();
    if (vertices > most_vertices(coded[k]) || triangles > coded[k].triangles)
      return unfit("a larger mesh than the scene claims");
    if (colours != 0 && colours != vertices) return unfit("another number of colours than of vertices");
    if (kVertexBytes * vertices + kTriangleBytes * triangles + kColourBytes * colours > r.remaining())
      return unfit("less than it says");
    meshes[k].positions_O.resize(vertices);
    for (glm::dvec3& p : meshes[k].positions_O)
      for (int i = 0; i < 3; ++i) p[i] = r.f32();
    meshes[k].triangles.resize(triangles);
    for (geometry::Triangle& triangle : meshes[k].triangles)
      for (std::uint32_t& index : triangle) index = r.u32();
    meshes[k].colours.resize(colours);
    for (Colour& colour : meshes[k].colours)
      for (std::uint8_t& channel : colour) channel = r.u8();
    if (const auto fault = fault_of(meshes[k])) return tl::unexpected(*fault);
  }
  if (!r.is_at_end()) return unfit("another length than its meshes have");
  return meshes;
}

std::size_t most_decoded_bytes(std::span<const CodedMesh> coded) {
  std::size_t bytes = 0;
  for (const CodedMesh& mesh : coded)
    bytes += kDecodedCountBytes + (kVertexBytes + kColourBytes) * most_vertices(mesh) + kTriangleBytes * mesh.triangles;
  return bytes;
}

}  // namespace farfeel::codecs
