// OFF: the word OFF (C, N, ST before it: colours, normals, texture coordinates, which stand behind the position and are
// passed over), the counts of vertices, faces and edges, then a vertex a line and a face a line. The word may be
// missing, or the counts stand in its line.
#include <fmt/format.h>

#include "codecs/mesh/mesh_file.h"
#include "codecs/mesh/polygon.h"
#include "codecs/mesh/text_cursor.h"

namespace farfeel::codecs {

MeshResult read_off(std::span<const std::byte> bytes) {
  const auto text = plain_text(bytes);
  if (!text) return tl::unexpected(text.error());
  TextCursor file(*text);
  std::size_t number = 0;
  const auto wrong = [&](std::string_view what) {
    return tl::unexpected(MeshError{fmt::format("line {}: {}", number, what)});
  };
  const auto next_line = [&] {  // with something in it
    while (!file.is_at_end()) {
      const std::string_view line = file.line();
      ++number;
      const std::string_view said = line.substr(0, line.find('#'));
      if (!TextCursor(said).word().empty()) return said;
    }
    return std::string_view();
  };

  std::string_view head = next_line();
  if (const std::size_t word = head.find("OFF"); word != std::string_view::npos) {
    const std::string_view kind = TextCursor(head.substr(0, word)).word();
    head.remove_prefix(word + 3);
    if (kind.find_first_not_of("STCN") != std::string_view::npos || TextCursor(head).word() == "BINARY") {
      return wrong(
          "it is an OFF file that is binary or not of three dimensions; save it as plain text OFF, PLY or STL");
    }
    if (TextCursor(head).word().empty()) head = next_line();
  }
  TextCursor counts(head);
  const auto vertices = number_in<std::uint64_t>(counts.word()), faces = number_in<std::uint64_t>(counts.word());
  if (!vertices || !faces) return wrong("it does not begin with OFF and the counts of vertices and faces");

  MeshInFile mesh;
  for (std::uint64_t v = 0; v < *vertices; ++v) {
    TextCursor line(next_line());
    glm::dvec3 p(0);
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = number_in<double>(line.word());
      if (!value) return wrong("a vertex needs three numbers");
      p[axis] = *value;
    }
    mesh.positions_O.push_back(p);
  }
  std::vector<std::uint32_t> corners;
  for (std::uint64_t f = 0; f < *faces; ++f) {
    TextCursor line(next_line());
    const auto count = number_in<std::uint64_t>(line.word());
    if (!count) return wrong("a face needs the number of its corners");
    corners.clear();
    for (std::uint64_t i = 0; i < *count; ++i) {
      const auto index = number_in<std::uint32_t>(line.word());
      if (!index || *index >= mesh.positions_O.size())
        return wrong(fmt::format("a face has no corner {}, or it is none of {} vertices", i, *vertices));
      corners.push_back(*index);
    }
    if (corners.size() < 3) continue;  // a point or an edge
    if (const auto fault = cut_polygon(mesh.positions_O, corners, mesh.triangles)) return wrong(*fault);
  }
  return with_faces(std::move(mesh));
}

}  // namespace farfeel::codecs
