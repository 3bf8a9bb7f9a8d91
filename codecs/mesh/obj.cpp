// Wavefront OBJ: "v x y z" and "f a[/..] b[/..] c[/..] ...", indices from one, negative ones from the end. Everything
// else (normals, textures, groups, materials, curves) is passed over.
#include <fmt/format.h>

#include "codecs/mesh/mesh_file.h"
#include "codecs/mesh/text_cursor.h"

namespace farfeel::codecs {

MeshResult read_obj(std::span<const std::byte> bytes) {
  geometry::TriangleMesh mesh;
  TextCursor file(bytes);
  const auto wrong = [](std::size_t line, std::string_view what) {
    return tl::unexpected(MeshError{fmt::format("line {}: {}", line, what)});
  };
  std::vector<std::uint32_t> corners;
  for (std::size_t number = 1; !file.is_at_end(); ++number) {
    TextCursor line(file.line());
    const std::string_view kind = line.word();
    if (kind == "v") {
      glm::dvec3 p(0);
      for (int axis = 0; axis < 3; ++axis) {
        const auto value = number_in<double>(line.word());
        if (!value) return wrong(number, "a vertex needs three numbers");
        p[axis] = *value;
      }
      mesh.positions_O.push_back(p);
    } else if (kind == "f") {
      corners.clear();
      for (std::string_view word = line.word(); !word.empty(); word = line.word()) {
        const auto index = number_in<std::int64_t>(word.substr(0, word.find('/')));
        const auto count = static_cast<std::int64_t>(mesh.positions_O.size());
        if (!index || *index == 0 || *index > count || *index < -count) {
          return wrong(number,
                       fmt::format("a face names vertex '{}', and {} have been given", word.substr(0, 32), count));
        }
        corners.push_back(static_cast<std::uint32_t>(*index > 0 ? *index - 1 : count + *index));
      }
      if (corners.size() < 3) return wrong(number, "a face needs three corners");
      for (std::size_t i = 2; i < corners.size(); ++i)
        mesh.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }
  }
  return mesh;
}

}  // namespace farfeel::codecs
