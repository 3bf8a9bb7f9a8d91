// The glTF side of an asset. What is drawn stands where every viewer looks, under KHR_draco_mesh_compression; what is
// felt stands in the root extension FARFEEL_haptic_surface, whose numbers are JSON and whose arrays are one buffer
// view, a felt stream (felt_stream.h).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "codecs/asset/asset.h"
#include "codecs/asset/asset_version_2.h"
#include "codecs/asset/felt_stream.h"
#include "codecs/asset/physics_json.h"
#include "codecs/mesh/draco_mesh.h"
#include "codecs/mesh/glb.h"
#include "haptic_core/geometry/piece_thickness.h"

namespace farfeel::codecs {
namespace {

using nlohmann::json;

constexpr const char* kExtension = "FARFEEL_haptic_surface";
constexpr const char* kDraco = "KHR_draco_mesh_compression";
constexpr std::uint64_t kVersion = 4, kToldVersion = 3, kOldestVersion = 2;              // the third has no detail
constexpr int kFloat = 5126, kUnsignedInt = 5125, kUnsignedByte = 5121, kTriangles = 4;  // glTF's names of types
constexpr std::uint64_t kDracoPosition = 0;  // the unique id of write_draco()'s positions
constexpr std::uint32_t kMostDrawnTriangles = 1U << 23;
constexpr std::uint64_t kMostCount = 1U << 28;

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
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }
  [[nodiscard]] const json& views() const { return views_; }

 private:
  std::vector<std::byte> bytes_;
  json views_ = json::array();
};

/// Light of each drawn vertex, as glTF has colours: that of the nearest vertex of the mesh before Draco renamed them.
std::vector<std::uint8_t> light_of_vertices(const Asset& asset, const geometry::TriangleMesh& drawn) {
  const NearestPoint nearest(asset.visible.positions_O);
  std::vector<std::uint8_t> light;
  for (const glm::dvec3& p : drawn.positions_O) {
    for (const std::uint8_t channel : asset.visible_colours[nearest.to(p)])
      light.push_back(static_cast<std::uint8_t>(std::lround(255 * light_of(channel))));
    light.push_back(255);  // opaque, and a multiple of four
  }
  return light;
}

json vector_json(const glm::dvec3& v) {
  return {v.x, v.y, v.z};
}

json felt_json(const Asset& asset, Buffer& buffer) {
  geometry::HapticSurface felt = asset.felt;
  felt.piece_thickness_m = geometry::piece_thickness_m(felt);
  const glm::dmat3& I = asset.inertia_O_kg_m2;
  json out{{"version", asset.detail.mesh.triangles.empty() ? kToldVersion : kVersion},
           {"felt_view", buffer.add(encoded_felt(felt, asset.detail.mesh))},
           {"coarse",
            {{"vertices", felt.coarse.positions_O.size()},
             {"triangles", felt.coarse.triangles.size()},
             {"pieces", felt.piece_count},
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
             {"charts", felt.charts.size()}}},
           {"material",
            {{"stiffness_N_per_m", asset.material.stiffness_N_per_m},
             {"damping_Ns_per_m", asset.material.damping_Ns_per_m},
             {"static_friction", asset.material.static_friction},
             {"dynamic_friction", asset.material.dynamic_friction}}},
           {"mass",
            {{"mass_kg", asset.mass_kg},
             {"mesh_origin_m", {asset.p_OM_O.x, asset.p_OM_O.y, asset.p_OM_O.z}},
             {"inertia_kg_m2", {I[0][0], I[1][0], I[2][0], I[0][1], I[1][1], I[2][1], I[0][2], I[1][2], I[2][2]}}}}};
  if (const FeltDetail& detail = asset.detail; !detail.mesh.triangles.empty())
    out["detail"] = {{"vertices", detail.mesh.positions_O.size()},
                     {"triangles", detail.mesh.triangles.size()},
                     {"reach_m", detail.reach_m},
                     {"texel_m", detail.texel_m}};
  return out;
}

/// Its charts and tiles are what its detail says, if it has one.
bool follows(const Asset& asset) {
  if (asset.detail.mesh.triangles.empty()) return true;
  geometry::HapticSurface felt = asset.felt;
  if (!follow(felt, static_cast<std::uint32_t>(asset.felt.charts.size()), asset.detail)) return false;
  const auto is_same_chart = [](const geometry::Chart& a, const geometry::Chart& b) {
    return a.X_OH == b.X_OH && a.texel_m == b.texel_m && a.columns == b.columns && a.rows == b.rows;
  };
  const auto is_same_tile = [](const geometry::HeightTile& a, const geometry::HeightTile& b) {
    return a.version == b.version && a.coefficients == b.coefficients;
  };
  return std::equal(felt.charts.begin(), felt.charts.end(), asset.felt.charts.begin(), asset.felt.charts.end(),
                    is_same_chart) &&
         std::equal(felt.tiles.begin(), felt.tiles.end(), asset.felt.tiles.begin(), asset.felt.tiles.end(),
                    is_same_tile);
}

}  // namespace

AssetResult<std::vector<std::byte>> write_asset(const Asset& asset) {
  if (const auto wrong = faults(asset); !wrong.empty()) {
    return tl::unexpected(AssetError{fmt::format("cannot write the asset {}: {}", asset.name, wrong.front())});
  }
  if (!can_be_told(asset.felt)) {
    return tl::unexpected(AssetError{fmt::format(
        "cannot write the asset {}: it has {} coarse triangles and {} height tiles, in charts one after the other; an "
        "asset has at most {} and {}; take fewer triangles or a smaller texture",
        asset.name, asset.felt.coarse.triangles.size(), asset.felt.tiles.size(), kMostFeltElements, kMostFeltTiles)});
  }
  if (!follows(asset)) {
    return tl::unexpected(AssetError{
        fmt::format("cannot write the asset {}: its heights are not those that follow from its detail; leave that out",
                    asset.name)});
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
  if (!asset.visible_colours.empty()) {
    const std::vector<std::uint8_t> light = light_of_vertices(asset, *drawn);
    gltf["materials"][0]["pbrMetallicRoughness"] = {{"metallicFactor", 0.0}, {"roughnessFactor", 0.8}};
    gltf["accessors"][2] = {{"bufferView", buffer.add(std::as_bytes(std::span(light)))},
                            {"componentType", kUnsignedByte},
                            {"normalized", true},
                            {"type", "VEC4"},
                            {"count", drawn->positions_O.size()}};
    primitive["attributes"]["COLOR_0"] = 2;
  }
  gltf["extensions"][kExtension] = felt_json(asset, buffer);
  gltf["bufferViews"] = buffer.views();
  gltf["buffers"][0]["byteLength"] = buffer.bytes().size();
  return joined_glb(gltf, buffer.bytes());
}

// --- reading ---------------------------------------------------------------------------------------------------------

namespace {

geometry::HapticSurface read_felt(AssetJson& reader, const json& surface, FeltDetail& detail) {
  const json &coarse = reader.object(surface, "coarse"), &displacement = reader.object(surface, "displacement");
  const auto count = [&](const json& in, const char* key, std::uint64_t most) {
    return static_cast<std::uint32_t>(reader.integer(in, key, most));
  };
  FeltCounts counts{.vertices = count(coarse, "vertices", kMostFeltElements),
                    .triangles = count(coarse, "triangles", kMostFeltElements),
                    .pieces = count(coarse, "pieces", kMostFeltElements),
                    .charts = count(displacement, "charts", kMostFeltElements),
                    .tiles = count(displacement, "tiles", kMostFeltTiles)};
  if (surface.contains("detail")) {
    const json& followed = reader.object(surface, "detail");
    counts.detail_vertices = count(followed, "vertices", kMostFeltElements);
    counts.detail_triangles = count(followed, "triangles", kMostFeltElements);
    detail.reach_m = reader.number(followed, "reach_m");
    detail.texel_m = reader.number(followed, "texel_m");
  }
  const geometry::HeightScale scale{reader.number(displacement, "offset_m"), reader.number(displacement, "scale_m")};
  if (reader.integer(displacement, "tile_side", geometry::kTileSide) != geometry::kTileSide)
    reader.fail(fmt::format("\"tile_side\" is not {}", geometry::kTileSide));
  const std::span<const std::byte> bytes = reader.bytes(surface, "felt_view");
  if (!reader.error().empty()) return {};
  auto felt = decoded_felt(bytes, counts, &detail.mesh);
  const bool is_told = counts.detail_triangles == 0;
  if (!felt || !(is_told || follow(*felt, counts.charts, detail))) {
    reader.fail("what is felt of it is not what the bake wrote: the file is damaged; bake it again");
    return {};
  }
  if (is_told) felt->scale = scale;
  return *std::move(felt);
}

HullBreaches read_breaches(AssetJson& reader, const json& coarse, std::uint32_t pieces) {
  const json& breaches = reader.object(coarse, "breaches");
  return {.outside = static_cast<std::uint32_t>(reader.integer(breaches, "outside", pieces)),
          .past_middle = static_cast<std::uint32_t>(reader.integer(breaches, "past_middle", pieces)),
          .worst_outside_m = reader.number(breaches, "worst_outside_m"),
          .worst_past_middle_m = reader.number(breaches, "worst_past_middle_m")};
}

void read_drawn(AssetJson& reader, const json& gltf, std::span<const std::byte> binary, Asset& asset) {
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
  asset.visible = *std::move(mesh);
  const json& attributes = reader.object(primitive, "attributes");
  if (!attributes.contains("COLOR_0")) return;
  const json& accessors = reader.object(gltf, "accessors");
  const std::uint64_t at = reader.integer(attributes, "COLOR_0", kMostCount);
  if (!accessors.is_array() || at >= accessors.size()) return reader.fail("its colours are nowhere");
  const std::size_t vertices = asset.visible.positions_O.size();
  if (reader.integer(accessors[at], "componentType", kFloat) != kUnsignedByte)
    return reader.fail("its colours are not as the bake writes them");
  const auto light = reader.values<std::uint8_t>(accessors[at], "bufferView", 4 * vertices);
  for (std::size_t v = 0; 4 * v < light.size(); ++v) {
    Colour& colour = asset.visible_colours.emplace_back();
    for (std::size_t c = 0; c < colour.size(); ++c) colour[c] = on_screen(light[4 * v + c] / 255.0);
  }
}

}  // namespace

AssetResult<Asset> read_asset(std::span<const std::byte> bytes) {
  const auto glb = split_glb(bytes);
  if (!glb) return tl::unexpected(AssetError{fmt::format("it {}", glb.error())});
  AssetJson reader(glb->json, glb->binary);
  const json& extensions = reader.object(glb->json, "extensions");
  const json& surface = reader.object(extensions, kExtension);
  if (!reader.error().empty()) {
    return tl::unexpected(AssetError{fmt::format("it has no {}; bake it first (farfeel-bake)", kExtension)});
  }
  const auto version = bounded_integer(surface, "version", kMostCount);
  if (!version || *version < kOldestVersion || *version > kVersion) {
    return tl::unexpected(AssetError{
        fmt::format("its {} is not of version {} to {}; bake it again", kExtension, kOldestVersion, kVersion)});
  }
  Asset asset;
  asset.felt =
      *version > kOldestVersion ? read_felt(reader, surface, asset.detail) : read_felt_of_version_2(reader, surface);
  asset.breaches = read_breaches(reader, reader.object(surface, "coarse"), asset.felt.piece_count);
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
