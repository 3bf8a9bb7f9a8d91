// Wavefront OBJ: "v x y z" and "f a[/..] b[/..] c[/..] ...", indices from one, negative ones from the end. Everything
// else (normals, textures, groups, materials, curves) is passed over. Vertices and faces go on in the next line where
// theirs ends in a backslash; other lines do not, since names and comments may end in one ("# C:\parts\").
#include <fmt/format.h>

#include "codecs/mesh/mesh_file.h"
#include "codecs/mesh/polygon.h"
#include "codecs/mesh/text_cursor.h"

namespace farfeel::codecs {
namespace {

/// Words of a vertex or a face, across the lines that it goes on in.
class Statement {
 public:
  Statement(TextCursor& file, std::size_t& line_number) : file_(file), number_(line_number), line_(file.line()) {}

  /// Empty at the end, and where a comment begins.
  std::string_view word() {
    while (true) {
      std::string_view word = line_.word();
      const bool goes_on = word.ends_with('\\') && TextCursor(line_.rest()).word().empty();
      if (goes_on) {
        word.remove_suffix(1);
        line_ = TextCursor(file_.line());
        ++number_;
        if (word.empty()) continue;
      }
      return word.starts_with('#') ? std::string_view() : word;
    }
  }

 private:
  TextCursor& file_;
  std::size_t& number_;
  TextCursor line_;
};

bool is_vertex_or_face(std::string_view line) {
  const std::string_view kind = TextCursor(line).word();
  return kind == "v" || kind == "f" || kind == "v\\" || kind == "f\\";
}

}  // namespace

MeshResult read_obj(std::span<const std::byte> bytes) {
  const auto text = plain_text(bytes);
  if (!text) return tl::unexpected(text.error());
  MeshInFile mesh;
  TextCursor file(*text);
  const auto wrong = [](std::size_t line, std::string_view what) {
    return tl::unexpected(MeshError{fmt::format("line {}: {}", line, what)});
  };
  std::vector<std::uint32_t> corners;
  for (std::size_t number = 1; !file.is_at_end(); ++number) {
    if (TextCursor ahead = file; !is_vertex_or_face(ahead.line())) {
      file = ahead;
      continue;
    }
    const std::size_t first_line = number;
    Statement line(file, number);
    if (line.word() == "v") {
      glm::dvec3 p(0);
      for (int axis = 0; axis < 3; ++axis) {
        const auto value = number_in<double>(line.word());
        if (!value) return wrong(first_line, "a vertex needs three numbers");
        p[axis] = *value;
      }
      while (!line.word().empty()) continue;
      mesh.positions_O.push_back(p);
    } else {
      corners.clear();
      for (std::string_view word = line.word(); !word.empty(); word = line.word()) {
        const auto index = number_in<std::int64_t>(word.substr(0, word.find('/')));
        const auto count = static_cast<std::int64_t>(mesh.positions_O.size());
        if (!index || *index == 0 || *index > count || *index < -count) {
          return wrong(first_line,
                       fmt::format("a face names vertex '{}', and {} have been given", word.substr(0, 32), count));
        }
        corners.push_back(static_cast<std::uint32_t>(*index > 0 ? *index - 1 : count + *index));
      }
      if (corners.size() < 3) return wrong(first_line, "a face needs three corners");
      if (const auto fault = cut_polygon(mesh.positions_O, corners, mesh.triangles)) return wrong(first_line, *fault);
    }
  }
  return with_faces(std::move(mesh));
}

}  // namespace farfeel::codecs
