// The glTF side of an asset. What is drawn stands where every viewer looks, under KHR_draco_mesh_compression; what is
// felt stands in the root extension FARFEEL_haptic_surface, whose numbers are JSON and whose arrays are buffer views of
// plain little-endian values:
//   positions f32 x 3, triangles u32 x 3, triangle_piece u32, triangle_chart u32, piece_thickness f32, tiles u16 x
//   1024, tile_versions u32.
#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <limits>

#include "codecs/asset/asset.h"
#include "codecs/asset/physics_json.h"
#include "codecs/mesh/draco_mesh.h"
#include "codecs/mesh/glb.h"
#include "haptic_core/geometry/piece_thickness.h"

namespace farfeel::codecs {
namespace {

using nlohmann::json;

constexpr const char* kExtension = "FARFEEL_haptic_surface";
constexpr const char* kDraco = "KHR_draco_mesh_compression";
constexpr std::uint64_t kVersion = 2;
constexpr int kFloat = 5126, kUnsignedInt = 5125, kTriangles = 4;  // glTF's names of types
constexpr std::uint64_t kDracoPosition = 0;                        // the unique id of write_draco()'s one attribute
constexpr std::uint32_t kMostDrawnTriangles = 1U << 23;
constexpr std::uint64_t kMostCharts = 1U << 20, kMostSide = 1U << 16, kMostCount = 1U << 28;

// --- writing ---------------------------------------------------------------------------------------------------------

/// The one binary buffer and the views into it.
class Buffer {
 public:
  /// Appends at the next multiple of four; gives the view's index.
  std::size_t add(std::span<const std::byte> bytes) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    views_.push_back({{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}});
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return views_.size() - 1;
  }
  template <typename T>
  std::size_t add_values(const std::vector<T>& values) {
    return add(std::as_bytes(std::span(values)));
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }
  [[nodiscard]] const json& views() const { return views_; }

 private:
  std::vector<std::byte> bytes_;
  json views_ = json::array();
};

json vector_json(const glm::dvec3& v) {
  return {v.x, v.y, v.z};
}

json felt_json(const Asset& asset, Buffer& buffer) {
  const geometry::HapticSurface& felt = asset.felt;
  std::vector<float> positions, thickness;
  std::vector<std::uint32_t> triangles, versions;
  std::vector<std::uint16_t> coefficients;
  for (const glm::dvec3& p : felt.coarse.positions_O) {
    for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(p[axis]));
  }
  for (const double thickness_m : geometry::piece_thickness_m(felt))
    thickness.push_back(static_cast<float>(thickness_m));
  for (const geometry::Triangle& t : felt.coarse.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
  for (const geometry::HeightTile& tile : felt.tiles) {
    versions.push_back(tile.version);
    coefficients.insert(coefficients.end(), tile.coefficients.begin(), tile.coefficients.end());
  }
  json charts = json::array();
  for (const geometry::Chart& chart : felt.charts) {
    const glm::dquat& R = chart.X_OH.R;
    charts.push_back({{"rotation", {R.x, R.y, R.z, R.w}},
                      {"translation", vector_json(chart.X_OH.p)},
                      {"texel_m", chart.texel_m},
                      {"columns", chart.columns},
                      {"rows", chart.rows},
                      {"first_tile", chart.first_tile}});
  }
  const glm::dmat3& I = asset.inertia_O_kg_m2;
  return {{"version", kVersion},
          {"coarse",
           {{"vertices", felt.coarse.positions_O.size()},
            {"triangles", felt.coarse.triangles.size()},
            {"pieces", felt.piece_count},
            {"positions_view", buffer.add_values(positions)},
            {"triangles_view", buffer.add_values(triangles)},
            {"triangle_piece_view", buffer.add_values(felt.triangle_piece)},
            {"triangle_chart_view", buffer.add_values(felt.triangle_chart)},
            {"piece_thickness_view", buffer.add_values(thickness)},
            {"breaches",
             {{"outside", asset.breaches.outside},
              {"past_middle", asset.breaches.past_middle},
              {"worst_outside_m", asset.breaches.worst_outside_m},
              {"worst_past_middle_m", asset.breaches.worst_past_middle_m}}}}},
          {"displacement",
           {{"offset_m", felt.scale.offset_m},
            {"scale_m", felt.scale.scale_m},
            {"tile_side", geometry::kTileSide},
            {"tiles", felt.tiles.size()},
            {"tiles_view", buffer.add_values(coefficients)},
            {"tile_versions_view", buffer.add_values(versions)},
            {"charts", charts}}},
          {"material",
           {{"stiffness_N_per_m", asset.material.stiffness_N_per_m},
            {"damping_Ns_per_m", asset.material.damping_Ns_per_m},
            {"static_friction", asset.material.static_friction},
            {"dynamic_friction", asset.material.dynamic_friction}}},
          {"mass",
           {{"mass_kg", asset.mass_kg},
            {"mesh_origin_m", {asset.p_OM_O.x, asset.p_OM_O.y, asset.p_OM_O.z}},
            {"inertia_kg_m2", {I[0][0], I[1][0], I[2][0], I[0][1], I[1][1], I[2][1], I[0][2], I[1][2], I[2][2]}}}}};
}

}  // namespace

AssetResult<std::vector<std::byte>> write_asset(const Asset& asset) {
  if (const auto wrong = faults(asset); !wrong.empty()) {
    return tl::unexpected(AssetError{fmt::format("cannot write the asset {}: {}", asset.name, wrong.front())});
  }
  // Draco reorders and quantises: what the file says of the drawn mesh is said of what a decoder gets.
  const auto bitstream = write_draco(asset.visible);
  const auto drawn = bitstream.and_then([](const auto& bytes) { return read_draco(bytes, kMostDrawnTriangles); });
  if (!drawn)
    return tl::unexpected(AssetError{fmt::format("cannot write the asset {}: {}", asset.name, drawn.error())});
  const geometry::Box box = geometry::bounding_box(*drawn);

  Buffer buffer;
  const std::size_t draco_view = buffer.add(*bitstream);
  json gltf;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "farfeel-bake"}};
  gltf["extensionsUsed"] = json::array({kDraco, kExtension, kPhysicsExtension});
  gltf["extensionsRequired"] = json::array({kDraco});
  gltf["scene"] = 0;
  gltf["scenes"][0]["nodes"] = json::array({0});
  gltf["nodes"][0] = {{"name", asset.name}, {"mesh", 0}};
  gltf["nodes"][0]["extensions"][kPhysicsExtension] = physics_node(asset);
  gltf["extensions"][kPhysicsExtension] = physics_document(asset);
  gltf["materials"][0]["pbrMetallicRoughness"] = {
      {"baseColorFactor", {0.6, 0.6, 0.62, 1.0}}, {"metallicFactor", 0.2}, {"roughnessFactor", 0.6}};
  gltf["accessors"][0] = {{"componentType", kFloat},
                          {"type", "VEC3"},
                          {"count", drawn->positions_O.size()},
                          {"min", vector_json(box.low)},
                          {"max", vector_json(box.high)}};
  gltf["accessors"][1] = {{"componentType", kUnsignedInt}, {"type", "SCALAR"}, {"count", drawn->triangles.size() * 3}};
  json& primitive = gltf["meshes"][0]["primitives"][0];
  primitive["attributes"]["POSITION"] = 0;
  primitive["indices"] = 1;
  primitive["mode"] = kTriangles;
  primitive["material"] = 0;
  primitive["extensions"][kDraco]["bufferView"] = draco_view;
  primitive["extensions"][kDraco]["attributes"]["POSITION"] = kDracoPosition;
  gltf["extensions"][kExtension] = felt_json(asset, buffer);
  gltf["bufferViews"] = buffer.views();
  gltf["buffers"][0]["byteLength"] = buffer.bytes().size();
  return joined_glb(gltf, buffer.bytes());
}

// --- reading ---------------------------------------------------------------------------------------------------------

namespace {

/// Reads members one after another; the first failure sticks, and everything after it gives zeros.
class Reader {
 public:
  Reader(const json& gltf, std::span<const std::byte> binary) : gltf_(gltf), binary_(binary) {}

  const json& object(const json& in, const char* key) {
    static const json kNone = json::object();
    const auto found = in.is_object() ? in.find(key) : in.end();
    if (!in.is_object() || found == in.end()) {
      fail(fmt::format("\"{}\" is missing", key));
      return kNone;
    }
    return *found;
  }
  std::uint64_t integer(const json& in, const char* key, std::uint64_t most) {
    const auto value = bounded_integer(in, key, most);
    if (!value) fail(value.error());
    return value.value_or(0);
  }
  double number(const json& in, const char* key) {
    const auto value = finite_number(in, key);
    if (!value) fail(value.error());
    return value.value_or(0);
  }
  template <std::size_t N>
  std::array<double, N> numbers(const json& in, const char* key) {
    std::array<double, N> out{};
    const json& list = object(in, key);
    if (!list.is_array() || list.size() != N) {
      fail(fmt::format("\"{}\" is not a list of {} numbers", key, N));
      return out;
    }
    for (std::size_t i = 0; i < N; ++i) {
      if (!list[i].is_number()) {
        fail(fmt::format("\"{}\" is not a list of {} numbers", key, N));
      } else {
        out[i] = list[i].get<double>();
      }
    }
    return out;
  }
  /// The view's values; their number must be exactly `count`.
  template <typename T>
  std::vector<T> values(const json& in, const char* key, std::uint64_t count) {
    const auto view = buffer_view(gltf_, binary_, integer(in, key, kMostCount));
    if (!view) {
      fail(view.error());
      return {};
    }
    if (view->size() % sizeof(T) != 0 || view->size() / sizeof(T) != count) {
      fail(fmt::format("\"{}\" has {} bytes, not {} values", key, view->size(), count));
      return {};
    }
    std::vector<T> out(count);
    if (count > 0) std::memcpy(out.data(), view->data(), view->size());
    return out;
  }
  void fail(std::string why) {
    if (error_.empty()) error_ = std::move(why);
  }
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  const json& gltf_;
  std::span<const std::byte> binary_;
  std::string error_;
};

void read_coarse(Reader& reader, const json& coarse, Asset& asset) {
  geometry::HapticSurface& felt = asset.felt;
  const std::uint64_t vertices = reader.integer(coarse, "vertices", kMostCount);
  const std::uint64_t triangles = reader.integer(coarse, "triangles", kMostCount);
  felt.piece_count = static_cast<std::uint32_t>(reader.integer(coarse, "pieces", triangles));
  const auto positions = reader.values<float>(coarse, "positions_view", 3 * vertices);
  const auto indices = reader.values<std::uint32_t>(coarse, "triangles_view", 3 * triangles);
  felt.triangle_piece = reader.values<std::uint32_t>(coarse, "triangle_piece_view", triangles);
  felt.triangle_chart = reader.values<std::uint32_t>(coarse, "triangle_chart_view", triangles);
  for (const float thickness_m : reader.values<float>(coarse, "piece_thickness_view", felt.piece_count))
    felt.piece_thickness_m.push_back(thickness_m);
  const json& breaches = reader.object(coarse, "breaches");
  asset.breaches = {
      .outside = static_cast<std::uint32_t>(reader.integer(breaches, "outside", felt.piece_count)),
      .past_middle = static_cast<std::uint32_t>(reader.integer(breaches, "past_middle", felt.piece_count)),
      .worst_outside_m = reader.number(breaches, "worst_outside_m"),
      .worst_past_middle_m = reader.number(breaches, "worst_past_middle_m")};
  for (std::size_t i = 0; i + 2 < positions.size(); i += 3) {
    felt.coarse.positions_O.emplace_back(positions[i], positions[i + 1], positions[i + 2]);
  }
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    felt.coarse.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
  }
}

void read_displacement(Reader& reader, const json& displacement, geometry::HapticSurface& felt) {
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
  const json& charts = reader.object(displacement, "charts");
  if (!charts.is_array() || charts.size() > kMostCharts) return reader.fail("\"charts\" is not a list, or too long");
  for (const json& in : charts) {
    const auto R = reader.numbers<4>(in, "rotation");
    const auto p = reader.numbers<3>(in, "translation");
    felt.charts.push_back({.X_OH = {glm::dquat(R[3], R[0], R[1], R[2]), {p[0], p[1], p[2]}},
                           .texel_m = reader.number(in, "texel_m"),
                           .columns = static_cast<std::uint32_t>(reader.integer(in, "columns", kMostSide)),
                           .rows = static_cast<std::uint32_t>(reader.integer(in, "rows", kMostSide)),
                           .first_tile = static_cast<std::uint32_t>(reader.integer(in, "first_tile", tiles))});
  }
}

void read_drawn(Reader& reader, const json& gltf, std::span<const std::byte> binary, Asset& asset) {
  static const json kNone = json::array();
  const auto first = [&](const json& in, const char* key) -> const json& {
    const json& list = reader.object(in, key);
    if (!list.is_array() || list.empty()) {
      reader.fail(fmt::format("\"{}\" is not a list with something in it", key));
      return kNone;
    }
    return list[0];
  };
  const json& node = first(gltf, "nodes");
  if (node.is_object() && node.contains("name") && node["name"].is_string())
    asset.name = node["name"].get<std::string>();
  const json& primitive = first(first(gltf, "meshes"), "primitives");
  const json& draco = reader.object(reader.object(primitive, "extensions"), kDraco);
  const std::uint64_t view = reader.integer(draco, "bufferView", kMostCount);
  (void)reader.integer(reader.object(draco, "attributes"), "POSITION", kDracoPosition);
  if (!reader.error().empty()) return;
  const auto bytes = buffer_view(gltf, binary, view);
  if (!bytes) return reader.fail(bytes.error());
  auto mesh = read_draco(*bytes, kMostDrawnTriangles);
  if (!mesh) return reader.fail(mesh.error());
  asset.visible = std::move(*mesh);
}

}  // namespace

AssetResult<Asset> read_asset(std::span<const std::byte> bytes) {
  const auto glb = split_glb(bytes);
  if (!glb) return tl::unexpected(AssetError{fmt::format("it {}", glb.error())});
  Reader reader(glb->json, glb->binary);
  const json& extensions = reader.object(glb->json, "extensions");
  const json& surface = reader.object(extensions, kExtension);
  if (!reader.error().empty()) {
    return tl::unexpected(AssetError{fmt::format("it has no {}; bake it first (farfeel-bake)", kExtension)});
  }
  if (const auto version = bounded_integer(surface, "version", kMostCount); !version || *version != kVersion) {
    return tl::unexpected(AssetError{fmt::format("its {} is not of version {}; bake it again", kExtension, kVersion)});
  }
  Asset asset;
  read_coarse(reader, reader.object(surface, "coarse"), asset);
  read_displacement(reader, reader.object(surface, "displacement"), asset.felt);
  const json& material = reader.object(surface, "material");
  asset.material = {.stiffness_N_per_m = reader.number(material, "stiffness_N_per_m"),
                    .damping_Ns_per_m = reader.number(material, "damping_Ns_per_m"),
                    .static_friction = reader.number(material, "static_friction"),
                    .dynamic_friction = reader.number(material, "dynamic_friction")};
  const json& mass = reader.object(surface, "mass");
  asset.mass_kg = reader.number(mass, "mass_kg");
  const auto mesh_origin = reader.numbers<3>(mass, "mesh_origin_m");
  asset.p_OM_O = {mesh_origin[0], mesh_origin[1], mesh_origin[2]};
  const auto rows = reader.numbers<9>(mass, "inertia_kg_m2");
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) asset.inertia_O_kg_m2[column][row] = rows[3 * row + column];
  }
  read_drawn(reader, glb->json, glb->binary, asset);
  if (!reader.error().empty()) return tl::unexpected(AssetError{reader.error()});
  if (const auto wrong = faults(asset); !wrong.empty()) return tl::unexpected(AssetError{wrong.front()});
  return asset;
}

}  // namespace farfeel::codecs
