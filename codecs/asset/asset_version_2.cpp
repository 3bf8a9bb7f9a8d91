// Arrays are buffer views of plain little-endian values: positions f32 x 3, triangles u32 x 3, triangle_piece u32,
// triangle_chart u32, piece_thickness f32, tiles u16 x 1024, tile_versions u32.
#include "codecs/asset/asset_version_2.h"

namespace farfeel::codecs {
namespace {

constexpr std::uint64_t kMostCharts = 1U << 20, kMostSide = 1U << 16, kMostCount = 1U << 28;

void read_coarse(AssetJson& reader, const nlohmann::json& coarse, geometry::HapticSurface& felt) {
  const std::uint64_t vertices = reader.integer(coarse, "vertices", kMostCount);
  const std::uint64_t triangles = reader.integer(coarse, "triangles", kMostCount);
  felt.piece_count = static_cast<std::uint32_t>(reader.integer(coarse, "pieces", triangles));
  const auto positions = reader.values<float>(coarse, "positions_view", 3 * vertices);
  const auto indices = reader.values<std::uint32_t>(coarse, "triangles_view", 3 * triangles);
  felt.triangle_piece = reader.values<std::uint32_t>(coarse, "triangle_piece_view", triangles);
  felt.triangle_chart = reader.values<std::uint32_t>(coarse, "triangle_chart_view", triangles);
  for (const float thickness_m : reader.values<float>(coarse, "piece_thickness_view", felt.piece_count))
    felt.piece_thickness_m.push_back(thickness_m);
  for (std::size_t i = 0; i + 2 < positions.size(); i += 3) {
    felt.coarse.positions_O.emplace_back(positions[i], positions[i + 1], positions[i + 2]);
  }
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    felt.coarse.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
  }
}

void read_displacement(AssetJson& reader, const nlohmann::json& displacement, geometry::HapticSurface& felt) {
  felt.scale.offset_m = reader.number(displacement, "offset_m");
  felt.scale.scale_m = reader.number(displacement, "scale_m");
  if (reader.integer(displacement, "tile_side", geometry::kTileSide) != geometry::kTileSide) {
    reader.fail(fmt::format("\"tile_side\" is not {}", geometry::kTileSide));
  }
  constexpr std::uint64_t kTileValues = geometry::kTileSide * geometry::kTileSide;
  const std::uint64_t tiles = reader.integer(displacement, "tiles", kMostCount);
  const auto coefficients = reader.values<std::uint16_t>(displacement, "tiles_view", tiles * kTileValues);
  const auto versions = reader.values<std::uint32_t>(displacement, "tile_versions_view", tiles);
  if (!reader.error().empty()) return;
  felt.tiles.resize(tiles);
  for (std::size_t i = 0; i < tiles; ++i) {
    felt.tiles[i].version = versions[i];
    std::memcpy(felt.tiles[i].coefficients.data(), &coefficients[i * kTileValues], kTileValues * sizeof(std::uint16_t));
  }
  const nlohmann::json& charts = reader.object(displacement, "charts");
  if (!charts.is_array() || charts.size() > kMostCharts) return reader.fail("\"charts\" is not a list, or too long");
  for (const nlohmann::json& in : charts) {
    const auto R = reader.numbers<4>(in, "rotation");
    const auto p = reader.numbers<3>(in, "translation");
    felt.charts.push_back({.X_OH = {glm::dquat(R[3], R[0], R[1], R[2]), {p[0], p[1], p[2]}},
                           .texel_m = reader.number(in, "texel_m"),
                           .columns = static_cast<std::uint32_t>(reader.integer(in, "columns", kMostSide)),
                           .rows = static_cast<std::uint32_t>(reader.integer(in, "rows", kMostSide)),
                           .first_tile = static_cast<std::uint32_t>(reader.integer(in, "first_tile", tiles))});
  }
}

}  // namespace

geometry::HapticSurface read_felt_of_version_2(AssetJson& reader, const nlohmann::json& surface) {
  geometry::HapticSurface felt;
  read_coarse(reader, reader.object(surface, "coarse"), felt);
  read_displacement(reader, reader.object(surface, "displacement"), felt);
  return felt;
}

}  // namespace farfeel::codecs
