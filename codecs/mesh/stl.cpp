// STL. Binary: 80 bytes of anything, the number of facets n, then n times 50 bytes: a normal, three corners, and a
// number of two bytes, which some makers use as a colour and some as the length of bytes of their own that follow the
// facet. Text begins with "solid", as the 80 bytes of some binary files do.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>

#include "codecs/mesh/mesh_file.h"
#include "codecs/mesh/polygon.h"
#include "codecs/mesh/text_cursor.h"

namespace farfeel::codecs {
namespace {

constexpr std::size_t kHeaderBytes = 84, kFacetBytes = 50, kNormalBytes = 12, kLengthAt = 48;

std::string lower(std::string_view word) {
  std::string out(word);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

/// Does it begin with "solid", and go on as text does?
bool is_text(std::string_view text) {
  constexpr std::size_t kLooked = 1024;
  const auto is_of_text = [](unsigned char c) { return c >= ' ' || std::isspace(c) != 0; };
  return lower(TextCursor(text).word().substr(0, 5)) == "solid" &&
         std::all_of(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(std::min(kLooked, text.size())),
                     is_of_text);
}

MeshResult read_text(std::string_view text) {
  MeshInFile mesh;
  TextCursor file(text);
  std::vector<std::uint32_t> corners;
  std::size_t number = 0;
  const auto wrong = [&](std::string_view what) {
    return tl::unexpected(MeshError{fmt::format("line {}: {}", number, what)});
  };
  while (!file.is_at_end()) {
    TextCursor line(file.line());
    ++number;
    for (std::string word = lower(line.word()); !word.empty(); word = lower(line.word())) {
      if (word == "solid" || word == "endsolid") break;  // a name follows
      if (word == "vertex") {
        glm::dvec3 p(0);
        for (int axis = 0; axis < 3; ++axis) {
          const auto value = number_in<double>(line.word());
          if (!value) return wrong("a vertex needs three numbers");
          p[axis] = *value;
        }
        corners.push_back(static_cast<std::uint32_t>(mesh.positions_O.size()));
        mesh.positions_O.push_back(p);
      } else if (word == "endloop" || word == "endfacet" || word == "facet") {
        if (!corners.empty() && corners.size() < 3) return wrong("a facet has no three corners");
        if (const auto fault = cut_polygon(mesh.positions_O, corners, mesh.triangles)) return wrong(*fault);
        corners.clear();
      }
    }
  }
  if (!corners.empty()) return wrong("the last facet has no end; the file may be cut short, so export it again");
  return with_faces(std::move(mesh));
}

/// Where each facet of a binary file begins; what was done about a length that does not fit, or why nothing was.
struct Facets {
  std::vector<std::size_t> at;
  std::string note;
};

std::array<float, 9> corners_at(std::span<const std::byte> bytes, std::size_t at) {
  std::array<float, 9> corners{};
  std::memcpy(corners.data(), &bytes[at + kNormalBytes], sizeof corners);
  return corners;
}

/// Are all of these facets' corners numbers, and is one of them not zero?
bool are_facets(std::span<const std::byte> bytes, std::size_t from) {
  bool is_zero = true;
  for (std::size_t at = from; at + kFacetBytes <= bytes.size(); at += kFacetBytes) {
    for (const float c : corners_at(bytes, at)) {
      if (!std::isfinite(c)) return false;
      is_zero = is_zero && c == 0;
    }
  }
  return !is_zero;
}

/// Every facet says how many bytes of its maker's follow it, and with them the file is exactly used up.
std::vector<std::size_t> facets_with_bytes_between(std::span<const std::byte> bytes, std::size_t count) {
  std::vector<std::size_t> at;
  std::size_t next = kHeaderBytes;
  for (std::size_t i = 0; i < count; ++i) {
    if (bytes.size() - next < kFacetBytes) return {};
    at.push_back(next);
    std::uint16_t more = 0;
    std::memcpy(&more, &bytes[next + kLengthAt], sizeof more);
    next += kFacetBytes + std::min<std::size_t>(more, bytes.size() - next - kFacetBytes);
  }
  return next == bytes.size() ? at : std::vector<std::size_t>();
}

tl::expected<Facets, MeshError> facets_of(std::span<const std::byte> bytes) {
  std::uint32_t counted = 0;
  std::memcpy(&counted, &bytes[kHeaderBytes - sizeof counted], sizeof counted);
  const std::size_t body = bytes.size() - kHeaderBytes, room = body / kFacetBytes;
  Facets out;
  std::size_t count = counted;
  if (counted < room || body != kFacetBytes * counted) {
    if (counted > 0 && counted <= room) out.at = facets_with_bytes_between(bytes, counted);
    const bool is_of_whole_facets = body % kFacetBytes == 0 && room > 0;
    const std::size_t beyond = kHeaderBytes + kFacetBytes * std::min<std::size_t>(counted, room);
    if (!out.at.empty()) {
      out.note = "bytes of the maker's after each facet passed over";
      return out;
    }
    if (is_of_whole_facets && are_facets(bytes, counted > room ? kHeaderBytes : beyond)) {
      out.note = fmt::format("its header counts {} facets, its length holds {}: all of these are read", counted, room);
      count = room;
    } else if (counted > 0 && counted < room + 1) {
      out.note = fmt::format("{} bytes after the last of its {} facets passed over", bytes.size() - beyond, counted);
    } else {
      return tl::unexpected(MeshError{
          fmt::format("it is {} bytes long, room for {} facets, and its header counts {}: it is cut short, or "
                      "no STL; export it again",
                      bytes.size(), room, counted)});
    }
  }
  for (std::size_t i = 0; i < count; ++i) out.at.push_back(kHeaderBytes + i * kFacetBytes);
  return out;
}

}  // namespace

MeshResult read_stl(std::span<const std::byte> bytes) {
  std::uint32_t counted = 0;
  if (bytes.size() >= kHeaderBytes) std::memcpy(&counted, &bytes[kHeaderBytes - sizeof counted], sizeof counted);
  const bool fits = bytes.size() >= kHeaderBytes && bytes.size() == kHeaderBytes + kFacetBytes * std::size_t{counted};
  if (!fits) {
    const auto text = plain_text(bytes);
    if (!text) return tl::unexpected(text.error());
    if (is_text(*text)) return read_text(*text);
    if (bytes.size() < kHeaderBytes) {
      return tl::unexpected(MeshError{fmt::format(
          "it is {} bytes long and does not begin with 'solid': neither a binary STL nor a text one", bytes.size())});
    }
  }
  const auto facets = facets_of(bytes);
  if (!facets) return tl::unexpected(facets.error());
  MeshInFile mesh;
  if (!facets->note.empty()) mesh.notes.push_back(facets->note);
  mesh.positions_O.reserve(3 * facets->at.size());
  for (const std::size_t at : facets->at) {
    const std::array<float, 9> corners = corners_at(bytes, at);
    const auto first = static_cast<std::uint32_t>(mesh.positions_O.size());
    for (std::size_t i = 0; i < 9; i += 3) mesh.positions_O.emplace_back(corners[i], corners[i + 1], corners[i + 2]);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return with_faces(std::move(mesh));
}

}  // namespace farfeel::codecs
