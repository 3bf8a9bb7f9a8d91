// PLY: a text header names elements and their properties in order; the body follows as text or as packed numbers. All
// elements are walked through, since binary ones can only be passed over by reading them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>

#include "codecs/mesh/mesh_file.h"
#include "codecs/mesh/polygon.h"
#include "codecs/mesh/text_cursor.h"

namespace farfeel::codecs {
namespace {

enum class Encoding { kText, kLittle, kBig };
enum class Type { kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64 };

struct Property {
  std::string_view name;
  Type type;
  std::optional<Type> count;  ///< of a list: the type of its length
};
struct Element {
  std::string_view name;
  std::uint64_t count;
  std::vector<Property> properties;
};
struct Header {
  Encoding encoding = Encoding::kText;
  std::vector<Element> elements;
};

std::optional<Type> type_named(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, Type>, 16> kNames{{{"char", Type::kI8},
                                                                      {"int8", Type::kI8},
                                                                      {"uchar", Type::kU8},
                                                                      {"uint8", Type::kU8},
                                                                      {"short", Type::kI16},
                                                                      {"int16", Type::kI16},
                                                                      {"ushort", Type::kU16},
                                                                      {"uint16", Type::kU16},
                                                                      {"int", Type::kI32},
                                                                      {"int32", Type::kI32},
                                                                      {"uint", Type::kU32},
                                                                      {"uint32", Type::kU32},
                                                                      {"float", Type::kF32},
                                                                      {"float32", Type::kF32},
                                                                      {"double", Type::kF64},
                                                                      {"float64", Type::kF64}}};
  for (const auto& [known, type] : kNames) {
    if (known == name) return type;
  }
  return std::nullopt;
}

tl::expected<Header, MeshError> read_header(TextCursor& file) {
  Header header;
  const auto wrong = [](std::string_view line) {
    return tl::unexpected(
        MeshError{fmt::format("its header has a line that is not understood: '{}'", line.substr(0, 60))});
  };
  // Where lines end in a return alone, the newline behind the last may be the body's first number.
  const std::string_view whole = file.rest();
  const std::size_t first_end = std::min(whole.find_first_of("\r\n"), whole.size());
  const bool has_returns = whole.substr(first_end).starts_with('\r') && !whole.substr(first_end).starts_with("\r\n");
  const auto next_line = [&] { return has_returns ? file.line_to_return() : file.line(); };
  if (TextCursor(next_line()).word() != "ply") return tl::unexpected(MeshError{"it does not begin with 'ply'"});
  while (!file.is_at_end()) {
    const std::string_view text = next_line();
    TextCursor line(text);
    const std::string_view key = line.word();
    if (key == "end_header") return header;
    if (key == "comment" || key == "obj_info" || key.empty()) continue;
    if (key == "format") {
      const std::string_view format = line.word();
      if (format == "ascii") {
        header.encoding = Encoding::kText;
      } else if (format == "binary_little_endian") {
        header.encoding = Encoding::kLittle;
      } else if (format == "binary_big_endian") {
        header.encoding = Encoding::kBig;
      } else {
        return wrong(text);
      }
    } else if (key == "element") {
      const std::string_view name = line.word();
      const auto count = number_in<std::uint64_t>(line.word());
      if (!count) return wrong(text);
      header.elements.push_back({name, *count, {}});
    } else if (key == "property" && !header.elements.empty()) {
      std::string_view word = line.word();
      std::optional<Type> count;
      if (word == "list") {
        count = type_named(line.word());
        if (!count) return wrong(text);
        word = line.word();
      }
      const auto type = type_named(word);
      if (!type) return wrong(text);
      header.elements.back().properties.push_back({line.word(), *type, count});
    } else {
      return wrong(text);
    }
  }
  return tl::unexpected(MeshError{"its header does not end"});
}

/// The body's numbers one after another; what is missing sets is_short.
class Numbers {
 public:
  Numbers(Encoding encoding, std::string_view body) : encoding_(encoding), text_(body), body_(body) {}

  double next(Type type) {
    if (encoding_ == Encoding::kText) {
      const auto value = number_in<double>(text_.word());
      if (!value) is_short_ = true;
      return value.value_or(0);
    }
    switch (type) {
      case Type::kI8:
        return packed<std::int8_t>();
      case Type::kU8:
        return packed<std::uint8_t>();
      case Type::kI16:
        return packed<std::int16_t>();
      case Type::kU16:
        return packed<std::uint16_t>();
      case Type::kI32:
        return packed<std::int32_t>();
      case Type::kU32:
        return packed<std::uint32_t>();
      case Type::kF32:
        return packed<float>();
      case Type::kF64:
        return packed<double>();
    }
    return 0;
  }
  [[nodiscard]] bool is_short() const { return is_short_; }

 private:
  template <typename T>
  double packed() {
    std::array<char, sizeof(T)> bytes{};
    if (body_.size() < sizeof(T)) {
      is_short_ = true;
      return 0;
    }
    std::memcpy(bytes.data(), body_.data(), sizeof(T));
    body_.remove_prefix(sizeof(T));
    if (encoding_ == Encoding::kBig) std::reverse(bytes.begin(), bytes.end());
    return static_cast<double>(std::bit_cast<T>(bytes));
  }

  Encoding encoding_;
  TextCursor text_;
  std::string_view body_;
  bool is_short_ = false;
};

/// Polygons, one after another.
class Faces {
 public:
  void add(std::span<const double> corners) {
    if (corners.size() < 3) return;
    corners_.insert(corners_.end(), corners.begin(), corners.end());
    ends_.push_back(corners_.size());
  }
  /// Each corner makes a triangle with the two before it, turned every second time; -1 begins anew.
  void add_strips(std::span<const double> strips) {
    std::size_t first = 0;
    for (std::size_t i = 0; i < strips.size(); ++i) {
      if (strips[i] == -1) first = i + 1;
      if (i < first + 2) continue;
      const std::size_t odd = (i - first) % 2;
      add(std::array{strips[i - 2], strips[i - 1 + odd], strips[i - odd]});
    }
  }
  /// What is wrong, or nothing.
  std::optional<MeshError> cut(MeshInFile& mesh) const {
    std::vector<std::uint32_t> face;
    std::size_t begin = 0;
    for (std::size_t n = 0; n < ends_.size(); ++n) {
      face.clear();
      for (; begin < ends_[n]; ++begin) {
        if (!(corners_[begin] >= 0 && corners_[begin] < static_cast<double>(mesh.positions_O.size())))
          return MeshError{fmt::format("a face names vertex {} of {}", corners_[begin], mesh.positions_O.size())};
        face.push_back(static_cast<std::uint32_t>(corners_[begin]));
      }
      if (const auto fault = cut_polygon(mesh.positions_O, face, mesh.triangles))
        return MeshError{fmt::format("face {}: {}", n + 1, *fault)};
    }
    return std::nullopt;
  }

 private:
  std::vector<double> corners_;
  std::vector<std::size_t> ends_;
};

/// Which of red, green and blue a property is, or -1.
int channel_of(std::string_view name) {
  if (name.starts_with("diffuse_")) name.remove_prefix(8);
  return name == "red" ? 0 : name == "green" ? 1 : name == "blue" ? 2 : -1;
}

/// Whole numbers go up to their type's most, others up to 1.
std::uint8_t channel(double value, Type type) {
  const double most = type == Type::kU8 ? 255 : type == Type::kU16 ? 65535 : 1;
  return static_cast<std::uint8_t>(std::lround(255 * (value > 0 ? std::min(value / most, 1.0) : 0)));
}

bool is_splat(const Header& header) {
  return std::any_of(header.elements.begin(), header.elements.end(), [](const Element& element) {
    return std::any_of(element.properties.begin(), element.properties.end(),
                       [](const Property& property) { return property.name == "f_dc_0"; });
  });
}

}  // namespace

MeshResult read_ply(std::span<const std::byte> bytes) {
  const auto plain = plain_text(bytes);
  if (!plain) return tl::unexpected(plain.error());
  TextCursor file(*plain);
  const auto header = read_header(file);
  if (!header) return tl::unexpected(header.error());
  if (is_splat(*header)) {
    return tl::unexpected(MeshError{
        "it is a Gaussian splat: a cloud of blurred points without faces; make a surface of it first, or export one"});
  }
  Numbers numbers(header->encoding, file.rest());
  MeshInFile mesh;
  bool has_vertices = false;
  std::vector<double> list;
  Faces faces;  // as given: they may stand before the vertices
  for (const Element& element : header->elements) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face",
               is_strips = element.name == "tristrips";
    has_vertices = has_vertices || is_vertex;
    if (element.properties.empty()) continue;
    for (std::uint64_t n = 0; n < element.count; ++n) {
      glm::dvec3 p(std::nan(""));
      Colour colour{};
      int channels = 0;
      for (const Property& property : element.properties) {
        if (!property.count) {
          const double value = numbers.next(property.type);
          if (property.name == "x") p.x = value;
          if (property.name == "y") p.y = value;
          if (property.name == "z") p.z = value;
          if (const int c = channel_of(property.name); c >= 0)
            colour[static_cast<std::size_t>(c)] = channel(value, property.type), ++channels;
        } else {
          const double length = numbers.next(*property.count);
          list.clear();
          for (double i = 0; i < length && !numbers.is_short(); ++i) list.push_back(numbers.next(property.type));
          if (property.name == "vertex_indices" || property.name == "vertex_index") {
            if (is_face) faces.add(list);
            if (is_strips) faces.add_strips(list);
          }
        }
        if (numbers.is_short())
          return tl::unexpected(MeshError{fmt::format("it ends within element '{}'", element.name)});
      }
      if (is_vertex) mesh.positions_O.push_back(p);
      if (is_vertex && channels == 3) mesh.colours.push_back(colour);
    }
  }
  if (mesh.colours.size() != mesh.positions_O.size()) mesh.colours.clear();
  if (!has_vertices) return tl::unexpected(MeshError{"it has no element 'vertex'"});
  if (auto wrong = faces.cut(mesh)) return tl::unexpected(*std::move(wrong));
  return with_faces(std::move(mesh));
}

}  // namespace farfeel::codecs
