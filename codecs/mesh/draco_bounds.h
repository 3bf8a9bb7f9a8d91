// How much a Draco bitstream will make Draco allocate, told before Draco sees it.
//
// Draco allocates for the counts that a bitstream claims, before it finds out whether they are true: a few bytes can
// ask for gigabytes. What is read here is the layout of an edgebreaker mesh in bitstream 2.2 up to its attributes'
// types.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace farfeel::codecs {

struct DracoBounds {
  std::uint32_t vertices = 0, triangles = 0;  ///< as many as are allocated for, not as many as come out
  bool has_colours = false;
};

/// Nothing, unless the bitstream is a mesh, edgebreaker with standard traversal, without metadata, with
/// positions of three floats and at most colours of three bytes, one of each a vertex, and long enough for the
/// triangles it claims. Reads nothing outside; allocates nothing.
[[nodiscard]] std::optional<DracoBounds> draco_bounds(std::span<const std::byte> bitstream) noexcept;

}  // namespace farfeel::codecs
