#include "haptic_core/penetration/egl/height_store.h"

#include <algorithm>
#include <cstring>

#include "haptic_core/penetration/egl/frame_layout.h"

namespace farfeel::penetration::egl {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 27;  ///< of a storage block, that every OpenGL 4.5 grants
constexpr std::uint32_t kSpare = 4;                       ///< entries beyond the last that a shader may read

std::uint32_t level_size(const geometry::Chart& chart, std::uint32_t level) {
  const std::uint32_t texels = 1u << level;
  return ((chart.columns + texels - 1) >> level) * ((chart.rows + texels - 1) >> level);
}

}  // namespace

std::uint32_t HeightStore::Room::take(std::uint32_t size) {
  std::uint32_t first = 0;
  for (const auto& [at, length] : taken) {
    if (at - first >= size) break;
    first = at + length;
  }
  taken.emplace(first, size);
  return first;
}

bool HeightStore::grow(Buffer& buffer, std::size_t bytes) {
  if (bytes <= buffer.bytes) return true;
  if (bytes > kMostBytes) return false;
  bytes = std::min(kMostBytes, std::max(bytes, 2 * buffer.bytes));
  GLuint larger = 0;
  gl_.CreateBuffers(1, &larger);
  gl_.NamedBufferStorage(larger, static_cast<GLsizeiptr>(bytes), nullptr, GL_DYNAMIC_STORAGE_BIT);
  if (gl_.GetError() != GL_NO_ERROR) {
    gl_.DeleteBuffers(1, &larger);
    return false;
  }
  if (buffer.name != 0) {
    gl_.CopyNamedBufferSubData(buffer.name, larger, 0, 0, static_cast<GLsizeiptr>(buffer.bytes));
    gl_.DeleteBuffers(1, &buffer.name);
  }
  buffer = {larger, bytes};
  bind();
  return true;
}

bool HeightStore::add(const FeltSurface& surface, SurfacePlace& place) {
  place = {};
  const auto& charts = surface.haptic().charts;
  for (const geometry::Chart& chart : charts) {
    SurfacePlace::Chart& at = place.charts.emplace_back();
    at.heights = place.heights_size;
    place.heights_size += (chart.columns + 2) * (chart.rows + 2);
    for (std::uint32_t level = 0; level < kBoundsLevels; ++level) {
      at.levels[level] = place.bounds_size;
      place.bounds_size += level_size(chart, level);
    }
  }
  place.heights_size = (place.heights_size + kSpare + 1) / 2 * 2;  // every surface begins at a word
  place.bounds_size += kSpare;
  {
    const std::scoped_lock lock(mutex_);
    place.heights_first = heights_room_.take(place.heights_size);
    place.bounds_first = bounds_room_.take(place.bounds_size);
  }
  if (!grow(heights_, 2 * (std::size_t{place.heights_first} + place.heights_size)) ||
      !grow(bounds_, 4 * (std::size_t{place.bounds_first} + place.bounds_size))) {
    release(place);
    return false;
  }
  for (std::uint32_t c = 0; c < charts.size(); ++c) {
    SurfacePlace::Chart& at = place.charts[c];
    at.heights += place.heights_first;
    gl_.NamedBufferSubData(heights_.name, 2 * GLintptr{at.heights},
                           2 * GLsizeiptr{charts[c].columns + 2} * (charts[c].rows + 2), surface.packed(c).heights);
    for (std::uint32_t level = 0; level < kBoundsLevels; ++level) {
      at.levels[level] += place.bounds_first;
      gl_.NamedBufferSubData(bounds_.name, 4 * GLintptr{at.levels[level]}, 4 * GLsizeiptr{level_size(charts[c], level)},
                             surface.bounds(c).level(level).entries);
    }
  }
  return gl_.GetError() == GL_NO_ERROR;
}

void HeightStore::release(const SurfacePlace& place) {
  const std::scoped_lock lock(mutex_);
  heights_room_.taken.erase(place.heights_first);
  bounds_room_.taken.erase(place.bounds_first);
}

void HeightStore::bind() const {
  if (heights_.name != 0) gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kHeightsBinding, heights_.name);
  if (bounds_.name != 0) gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, kBoundsBinding, bounds_.name);
}

bool append_changes(const FeltSurface& surface, const SurfacePlace& place, std::uint64_t& seen,
                    std::vector<std::uint8_t>& bytes, std::vector<TileCopy>& copies) noexcept {
  const auto append = [&](bool is_bounds, const void* from, std::uint32_t to, std::size_t size) {
    if (bytes.size() + size > bytes.capacity() || copies.size() == copies.capacity()) return false;
    copies.push_back({is_bounds, static_cast<std::uint32_t>(bytes.size()), to, static_cast<std::uint32_t>(size)});
    const auto* first = static_cast<const std::uint8_t*>(from);
    bytes.insert(bytes.end(), first, first + size);
    return true;
  };
  const auto append_tile = [&](std::uint32_t tile) {
    const FeltSurface::TilePlace at = surface.place_of(tile);
    const PackedHeights packed = surface.packed(at.chart);
    for (std::uint32_t row = at.first_row; row < at.first_row + at.rows; ++row) {
      const std::size_t first = std::size_t{row} * packed.stride + at.first_column;
      const auto to = static_cast<std::uint32_t>(2 * (place.charts[at.chart].heights + first));
      if (!append(false, packed.heights + first, to, 2 * std::size_t{at.columns})) return false;
    }
    // As in FeltSurface::take_tile and HeightBounds::update, with the neighbours that a change grows into.
    for (std::uint32_t level = 0; level < kBoundsLevels; ++level) {
      const BoundsLevel bounds = surface.bounds(at.chart).level(level);
      const auto low = [level](std::uint32_t first) {
        const std::uint32_t block = (first - std::min(first, 2u)) >> level;
        return block - std::min(block, 1u);
      };
      const auto end = [level](std::uint32_t last, std::uint32_t size) { return std::min((last >> level) + 2, size); };
      const std::uint32_t first_column = low(at.first_column),
                          end_column = end(at.first_column + at.columns, bounds.columns),
                          end_row = end(at.first_row + at.rows, bounds.rows);
      for (std::uint32_t row = low(at.first_row); row < end_row; ++row) {
        const std::size_t first = std::size_t{row} * bounds.columns + first_column;
        const auto to = static_cast<std::uint32_t>(4 * (place.charts[at.chart].levels[level] + first));
        if (!append(true, bounds.entries + first, to, 4 * std::size_t{end_column - first_column})) return false;
      }
    }
    return true;
  };
  const auto changes = surface.tile_changes();
  while (seen != surface.changes()) {
    // The oldest change that has not been seen; a tile that changed twice counts where it changed last.
    auto oldest = changes.end();
    for (auto it = changes.begin(); it != changes.end(); ++it) {
      if (*it > seen && (oldest == changes.end() || *it < *oldest)) oldest = it;
    }
    const std::size_t bytes_before = bytes.size(), copies_before = copies.size();
    if (!append_tile(static_cast<std::uint32_t>(oldest - changes.begin()))) {
      bytes.resize(bytes_before);
      copies.resize(copies_before);
      return false;
    }
    seen = *oldest;
  }
  return true;
}

}  // namespace farfeel::penetration::egl
