// STL: a binary file is exactly 84 + 50 n bytes, n at byte 80; anything else that begins with "solid" is text.
#include <fmt/format.h>

#include <cstring>

#include "codecs/mesh/mesh_file.h"
#include "codecs/mesh/text_cursor.h"

namespace farfeel::codecs {
namespace {

constexpr std::size_t kHeaderBytes = 84, kFacetBytes = 50, kNormalBytes = 12;

void add_corner(geometry::TriangleMesh& mesh, const glm::dvec3& p) {
  mesh.positions_O.push_back(p);
  if (mesh.positions_O.size() % 3 != 0) return;
  const auto last = static_cast<std::uint32_t>(mesh.positions_O.size() - 1);
  mesh.triangles.push_back({last - 2, last - 1, last});
}

MeshResult read_text(std::span<const std::byte> bytes) {
  geometry::TriangleMesh mesh;
  TextCursor file(bytes);
  for (std::size_t number = 1; !file.is_at_end(); ++number) {
    TextCursor line(file.line());
    if (line.word() != "vertex") continue;
    glm::dvec3 p(0);
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = number_in<double>(line.word());
      if (!value) return tl::unexpected(MeshError{fmt::format("line {}: a vertex needs three numbers", number)});
      p[axis] = *value;
    }
    add_corner(mesh, p);
  }
  if (mesh.positions_O.size() % 3 != 0) return tl::unexpected(MeshError{"the last facet has no three corners"});
  return mesh;
}

}  // namespace

MeshResult read_stl(std::span<const std::byte> bytes) {
  std::uint32_t facets = 0;
  if (bytes.size() >= kHeaderBytes) std::memcpy(&facets, &bytes[kHeaderBytes - sizeof facets], sizeof facets);
  if (bytes.size() < kHeaderBytes || bytes.size() != kHeaderBytes + kFacetBytes * std::size_t{facets}) {
    if (bytes.size() >= 5 && std::memcmp(bytes.data(), "solid", 5) == 0) return read_text(bytes);
    return tl::unexpected(MeshError{fmt::format(
        "it is {} bytes long, which is neither a binary STL of {} facets nor a text one", bytes.size(), facets)});
  }
  geometry::TriangleMesh mesh;
  mesh.positions_O.reserve(3 * std::size_t{facets});
  for (std::size_t at = kHeaderBytes; at < bytes.size(); at += kFacetBytes) {
    std::array<float, 9> corners{};
    std::memcpy(corners.data(), &bytes[at + kNormalBytes], sizeof corners);
    for (std::size_t i = 0; i < 9; i += 3) add_corner(mesh, {corners[i], corners[i + 1], corners[i + 2]});
  }
  return mesh;
}

}  // namespace farfeel::codecs
