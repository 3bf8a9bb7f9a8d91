// Wavefront OBJ: "v x y z" and "f a[/..] b[/..] c[/..] ...", indices from one, negative ones from the end; "o name" and
// "g name" where parts are asked for. Everything else (normals, textures, materials, curves) is passed over. Vertices
// and faces go on in the next line where theirs ends in a backslash; other lines do not, since names and comments may
// end in one ("# C:\parts\").
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "codecs/mesh/mesh_parts.h"
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

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") + 1 - first);
}

/// Behind a vertex some programs write its colour, in [0, 1].
void add_colour(const std::array<double, 3>& rgb, MeshInFile& mesh) {
  if (mesh.colours.size() + 1 != mesh.positions_O.size()) return;  // not all have one: none is kept
  Colour& colour = mesh.colours.emplace_back();
  for (std::size_t i = 0; i < rgb.size(); ++i)
    colour[i] = static_cast<std::uint8_t>(std::lround(255 * (rgb[i] > 0 ? std::min(rgb[i], 1.0) : 0)));
}

bool is_vertex_or_face(std::string_view line) {
  const std::string_view kind = TextCursor(line).word();
  return kind == "v" || kind == "f" || kind == "v\\" || kind == "f\\";
}

/// Faces from here on are of the object, or of the group, of that name.
struct Named {
  std::size_t first_triangle;
  std::string_view name;
};
struct Names {
  std::vector<Named> objects, groups;
};

MeshResult read(std::span<const std::byte> bytes, Names& names) {
  const auto text = plain_text(bytes);
  if (!text) return tl::unexpected(text.error());
  MeshInFile mesh;
  TextCursor file(*text);
  const auto wrong = [](std::size_t line, std::string_view what) {
    return tl::unexpected(MeshError{fmt::format("line {}: {}", line, what)});
  };
  std::size_t curved = 0;
  std::vector<std::uint32_t> corners;
  for (std::size_t number = 1; !file.is_at_end(); ++number) {
    TextCursor ahead = file;
    if (const std::string_view line = ahead.line(); !is_vertex_or_face(line)) {
      file = ahead;
      TextCursor words(line);
      const std::string_view kind = words.word();
      constexpr std::array kCurved{"curv", "curv2", "surf", "l"};
      if (std::find(kCurved.begin(), kCurved.end(), kind) != kCurved.end()) ++curved;
      if (kind == "o" || kind == "g")
        (kind == "o" ? names.objects : names.groups).push_back({mesh.triangles.size(), trimmed(words.rest())});
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
      std::array<double, 3> more{};
      std::size_t count = 0;
      for (std::string_view word = line.word(); !word.empty(); word = line.word(), ++count) {
        if (count < more.size()) more[count] = number_in<double>(word).value_or(-1);
      }
      mesh.positions_O.push_back(p);
      if (count == more.size()) add_colour(more, mesh);
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
  if (mesh.colours.size() < mesh.positions_O.size()) mesh.colours.clear();
  if (curved > 0) {
    const std::string words = fmt::format("{} lines, curves or free-form surfaces", curved);
    if (mesh.triangles.empty()) {
      return tl::unexpected(
          MeshError{fmt::format("it has no triangles, but {}; make a mesh of it first, and export that", words)});
    }
    mesh.notes.push_back(fmt::format("{} are passed over", words));
  }
  return with_faces(std::move(mesh));
}

/// Some of its triangles, with the vertices that these have.
class Extract {
 public:
  explicit Extract(const MeshInFile& from) : from_(from) {}
  void add(const geometry::Triangle& triangle) {
    geometry::Triangle& t = mesh.triangles.emplace_back(triangle);
    for (std::uint32_t& v : t) {
      const auto [named, is_new] = names_.try_emplace(v, static_cast<std::uint32_t>(names_.size()));
      if (is_new) mesh.positions_O.push_back(from_.positions_O[v]);
      if (is_new && !from_.colours.empty()) mesh.colours.push_back(from_.colours[v]);
      v = named->second;
    }
  }
  MeshInFile mesh;

 private:
  const MeshInFile& from_;
  std::unordered_map<std::uint32_t, std::uint32_t> names_;
};

}  // namespace

MeshResult read_obj(std::span<const std::byte> bytes) {
  Names unused;
  return read(bytes, unused);
}

tl::expected<MeshParts, MeshError> read_obj_parts(std::span<const std::byte> bytes) {
  Names names;
  const MeshResult whole = read(bytes, names);
  if (!whole) return tl::unexpected(whole.error());
  const std::vector<Named>& named = names.objects.empty() ? names.groups : names.objects;
  std::vector<std::pair<std::string_view, Extract>> extracts;
  std::size_t next = 0;
  std::string_view name;  // before the first there may be faces without any
  std::unordered_map<std::string_view, std::size_t> of_name;
  for (std::size_t i = 0; i < whole->triangles.size(); ++i) {
    while (next < named.size() && named[next].first_triangle <= i) name = named[next++].name;
    const auto [found, is_new] = of_name.try_emplace(name, extracts.size());
    if (is_new) extracts.emplace_back(name, Extract(*whole));
    if (extracts.size() > kMostParts) return tl::unexpected(MeshError{too_many_parts()});
    extracts[found->second].second.add(whole->triangles[i]);
  }
  MeshParts out;
  for (auto& [part, extract] : extracts) {
    out.parts.push_back({std::string(part), out.shapes.size()});
    out.shapes.push_back(std::move(extract.mesh));
  }
  return out;
}

}  // namespace farfeel::codecs
