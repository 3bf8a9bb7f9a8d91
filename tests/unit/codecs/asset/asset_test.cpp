#include "codecs/asset/asset.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <random>

#include "codecs/mesh/glb.h"
#include "haptic_core/geometry/piece_thickness.h"
#include "slave_sim/models/height_plate.h"
#include "tests/support/private_folder.h"

namespace farfeel::codecs {
namespace {

constexpr slave_sim::PlateSize kSmall{{0.004, 0.003, 0.002}, 1e-4};

Asset plate_asset(const slave_sim::PlateSize& size = {}) {
  Asset asset;
  asset.name = "a plate, \"quoted\"";
  asset.felt =
      slave_sim::height_plate([](double x, double y) { return 1e-4 * std::sin(900 * x) * std::cos(700 * y); }, size);
  asset.felt.charts[0].X_OH.R = spatial::rotation_from_vector({0.1, -0.2, 0.3});  // digits to lose
  asset.felt.tiles[2].version = 77;
  asset.breaches = {.outside = 1, .past_middle = 0, .worst_outside_m = 7e-5, .worst_past_middle_m = 1e-5};
  asset.visible = asset.felt.coarse;
  asset.material = {
      .stiffness_N_per_m = 1234.5, .damping_Ns_per_m = 0.1, .static_friction = 0.3, .dynamic_friction = 1.0 / 3 - 0.1};
  asset.mass_kg = 0.1 + 0.2;
  asset.inertia_O_kg_m2 = glm::dmat3(1e-5, 1e-7, 0, 1e-7, 2e-5, 3e-7, 0, 3e-7, 2.5e-5);
  return asset;
}

void expect_felt_the_same(const Asset& a, const Asset& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.felt.coarse.positions_O, b.felt.coarse.positions_O);
  EXPECT_EQ(a.felt.coarse.triangles, b.felt.coarse.triangles);
  EXPECT_EQ(a.felt.triangle_piece, b.felt.triangle_piece);
  EXPECT_EQ(a.felt.triangle_chart, b.felt.triangle_chart);
  EXPECT_EQ(a.felt.piece_count, b.felt.piece_count);
  EXPECT_EQ(geometry::piece_thickness_m(a.felt), b.felt.piece_thickness_m);
  EXPECT_EQ(a.breaches.outside, b.breaches.outside);
  EXPECT_EQ(a.breaches.past_middle, b.breaches.past_middle);
  EXPECT_EQ(a.breaches.worst_outside_m, b.breaches.worst_outside_m);
  EXPECT_EQ(a.breaches.worst_past_middle_m, b.breaches.worst_past_middle_m);
  ASSERT_EQ(a.felt.charts.size(), b.felt.charts.size());
  for (std::size_t i = 0; i < a.felt.charts.size(); ++i) {
    const geometry::Chart &x = a.felt.charts[i], &y = b.felt.charts[i];
    EXPECT_EQ(x.X_OH, y.X_OH);
    EXPECT_EQ(x.texel_m, y.texel_m);
    EXPECT_EQ(x.columns, y.columns);
    EXPECT_EQ(x.rows, y.rows);
    EXPECT_EQ(x.first_tile, y.first_tile);
  }
  ASSERT_EQ(a.felt.tiles.size(), b.felt.tiles.size());
  for (std::size_t i = 0; i < a.felt.tiles.size(); ++i) {
    EXPECT_EQ(a.felt.tiles[i].version, b.felt.tiles[i].version);
    EXPECT_EQ(a.felt.tiles[i].coefficients, b.felt.tiles[i].coefficients);
  }
  EXPECT_EQ(a.felt.scale.offset_m, b.felt.scale.offset_m);
  EXPECT_EQ(a.felt.scale.scale_m, b.felt.scale.scale_m);
  EXPECT_EQ(a.material.stiffness_N_per_m, b.material.stiffness_N_per_m);
  EXPECT_EQ(a.material.damping_Ns_per_m, b.material.damping_Ns_per_m);
  EXPECT_EQ(a.material.static_friction, b.material.static_friction);
  EXPECT_EQ(a.material.dynamic_friction, b.material.dynamic_friction);
  EXPECT_EQ(a.mass_kg, b.mass_kg);
  EXPECT_EQ(a.inertia_O_kg_m2, b.inertia_O_kg_m2);
}

TEST(AssetTest, WhatIsFeltRoundTripsExactly) {
  const Asset asset = plate_asset();
  const auto bytes = write_asset(asset);
  ASSERT_TRUE(bytes) << bytes.error().message;
  const auto back = read_asset(*bytes);
  ASSERT_TRUE(back) << back.error().message;
  expect_felt_the_same(asset, *back);
  EXPECT_EQ(back->visible.triangles.size(), asset.visible.triangles.size());
}

TEST(AssetTest, WhatIsDrawnMovesByDracosGridAtMost) {
  const Asset asset = plate_asset();
  const auto back = read_asset(write_asset(asset).value());
  ASSERT_TRUE(back);
  const geometry::Box before = geometry::bounding_box(asset.visible), after = geometry::bounding_box(back->visible);
  EXPECT_LT(glm::length(before.low - after.low) + glm::length(before.high - after.high), 1e-5);
  EXPECT_TRUE(geometry::is_closed_and_oriented(back->visible));
}

TEST(AssetTest, AFileOfVersion2IsReadAsItWasWritten) {
  const auto kept = read_asset_file(FARFEEL_ASSET_VERSION_2);
  ASSERT_TRUE(kept) << kept.error().message;
  expect_felt_the_same(plate_asset(kSmall), *kept);
  const std::vector<std::byte> newer = write_asset(*kept).value();
  EXPECT_LT(newer.size(), std::filesystem::file_size(FARFEEL_ASSET_VERSION_2) / 2);
  expect_felt_the_same(*kept, read_asset(newer).value());
}

TEST(AssetTest, ColoursOfWhatIsDrawnAreKept) {
  Asset asset = plate_asset(kSmall);
  EXPECT_TRUE(read_asset(write_asset(asset).value()).value().visible_colours.empty());
  for (const glm::dvec3& p : asset.visible.positions_O)
    asset.visible_colours.push_back(
        {static_cast<std::uint8_t>(p.x > 0 ? 250 : 20), static_cast<std::uint8_t>(p.y > 0 ? 90 : 0), 200});
  const Asset back = read_asset(write_asset(asset).value()).value();
  ASSERT_EQ(back.visible_colours.size(), back.visible.positions_O.size());
  for (std::size_t v = 0; v < back.visible_colours.size(); ++v) {
    const glm::dvec3& p = back.visible.positions_O[v];
    EXPECT_NEAR(back.visible_colours[v][0], p.x > 0 ? 250 : 20, 3);
    EXPECT_NEAR(back.visible_colours[v][1], p.y > 0 ? 90 : 0, 3);
    EXPECT_NEAR(back.visible_colours[v][2], 200, 3);
  }
  const std::vector<std::byte> bytes = write_asset(asset).value();
  const auto spoilt = [&](auto spoil) {
    Glb glb = split_glb(bytes).value();
    spoil(glb.json);
    return read_asset(joined_glb(glb.json, glb.binary)).has_value();
  };
  using nlohmann::json;
  EXPECT_TRUE(spoilt([](json&) {}));
  EXPECT_FALSE(spoilt([](json& j) { j["accessors"][2]["bufferView"] = 0; }));
  EXPECT_FALSE(spoilt([](json& j) { j["accessors"][2]["componentType"] = 5123; }));
  EXPECT_FALSE(spoilt([](json& j) { j["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 99; }));
  asset.visible_colours.pop_back();
  EXPECT_FALSE(write_asset(asset));
}

TEST(AssetTest, FilesRoundTripAndMissingOnesSayWhich) {
  const test_support::PrivateFolder folder;
  const std::string path = folder / "asset.glb";
  ASSERT_TRUE(write_asset_file(plate_asset(), path));
  const auto back = read_asset_file(path);
  ASSERT_TRUE(back) << back.error().message;
  expect_felt_the_same(plate_asset(), *back);
  std::filesystem::remove(path);
  const auto none = read_asset_file(path);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("asset.glb"), std::string::npos);
  EXPECT_FALSE(write_asset_file(plate_asset(), "/nowhere/at/all.glb"));
}

TEST(AssetTest, WritesThroughLinksAndOverNothingButFiles) {
  namespace fs = std::filesystem;
  const test_support::PrivateFolder folder;
  const fs::path other = folder / "other", link = folder / "link.glb", loop = folder / "loop.glb";
  fs::create_directory(other);
  fs::create_symlink("other/real.glb", link);
  ASSERT_TRUE(write_asset_file(plate_asset(), link));  // to a file that is not there yet
  ASSERT_TRUE(write_asset_file(plate_asset(), link));  // and over it
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_TRUE(fs::is_regular_file(other / "real.glb"));
  fs::create_symlink("loop.glb", loop);
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  fs::create_symlink("/dev/null", fs::path(folder / "null"));
  for (const fs::path& no_file : {loop, other, fs::path(folder / "pipe"), fs::path(folder / "null"),
                                  fs::path(folder / "no/such.glb"), fs::path("/dev/full")})
    EXPECT_FALSE(write_asset_file(plate_asset(), no_file)) << no_file;
  EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  fs::create_directory(other / "busy.glb.part");  // what is written beside cannot be
  EXPECT_FALSE(write_asset_file(plate_asset(), other / "busy.glb"));
  EXPECT_EQ(std::distance(fs::directory_iterator(other), {}), 2) << "nothing is left beside";
}

TEST(AssetTest, RefusesToWriteWhatIsFaulty) {
  const auto is_refused = [](auto spoil) {
    Asset asset = plate_asset();
    spoil(asset);
    return !write_asset(asset).has_value();
  };
  EXPECT_TRUE(is_refused([](Asset& a) { a.mass_kg = 0; }));
  EXPECT_TRUE(is_refused([](Asset& a) { a.mass_kg = std::nan(""); }));
  EXPECT_TRUE(is_refused([](Asset& a) { a.inertia_O_kg_m2[0][1] = 1; }));
  EXPECT_TRUE(is_refused([](Asset& a) { a.inertia_O_kg_m2 = -a.inertia_O_kg_m2; }));
  EXPECT_TRUE(is_refused([](Asset& a) { a.material.dynamic_friction = 2; }));
  EXPECT_TRUE(is_refused([](Asset& a) { a.felt.coarse.positions_O[0].x = 0.1; }));  // not a float
  EXPECT_TRUE(is_refused([](Asset& a) { a.felt.triangle_piece[0] = 9; }));
  EXPECT_TRUE(is_refused([](Asset& a) { a.felt.tiles.pop_back(); }));
  EXPECT_TRUE(is_refused([](Asset& a) { a.visible.triangles.clear(); }));
}

TEST(AssetTest, RefusesThicknessesThatCannotBe) {
  for (const double thickness_m : {-1e-3, 1e3, std::nan("")}) {
    Asset asset = plate_asset();
    asset.felt.piece_thickness_m.assign(asset.felt.piece_count, thickness_m);
    EXPECT_FALSE(write_asset(asset));
  }
  Asset asset = plate_asset();
  asset.felt.piece_thickness_m.assign(asset.felt.piece_count + 1, 1e-3);
  EXPECT_FALSE(write_asset(asset));
}

/// The asset's JSON, changed by `spoil` and packed again.
template <typename Spoil>
bool reads_after(Spoil spoil) {
  const std::vector<std::byte> bytes = write_asset(plate_asset(kSmall)).value();
  Glb glb = split_glb(bytes).value();
  spoil(glb.json);
  return read_asset(joined_glb(glb.json, glb.binary)).has_value();
}

TEST(AssetTest, RefusesJsonThatDoesNotAddUp) {
  using nlohmann::json;
  EXPECT_TRUE(reads_after([](json&) {}));
  const auto felt = [](json& j) -> json& { return j["extensions"]["FARFEEL_haptic_surface"]; };
  EXPECT_FALSE(reads_after([](json& j) { j.erase("extensions"); }));
  EXPECT_FALSE(reads_after([&](json& j) { felt(j)["version"] = 1; }));
  EXPECT_FALSE(reads_after([&](json& j) { felt(j)["coarse"]["vertices"] = 9; }));
  EXPECT_FALSE(reads_after([&](json& j) { felt(j)["coarse"]["vertices"] = -1; }));
  EXPECT_FALSE(reads_after([&](json& j) { felt(j)["coarse"]["pieces"] = 0; }));
  EXPECT_FALSE(reads_after([&](json& j) { felt(j)["felt_view"] = 99; }));
  EXPECT_FALSE(reads_after([&](json& j) { felt(j)["felt_view"] = 0; }));  // the drawn mesh
  EXPECT_FALSE(reads_after([&](json& j) { felt(j).erase("felt_view"); }));
  const auto breaches = [&](json& j) -> json& { return felt(j)["coarse"]["breaches"]; };
  EXPECT_FALSE(reads_after([&](json& j) { felt(j)["coarse"].erase("breaches"); }));
  EXPECT_FALSE(reads_after([&](json& j) { breaches(j)["outside"] = 99; }));
  EXPECT_FALSE(reads_after([&](json& j) { breaches(j)["worst_past_middle_m"] = -1; }));
  for (const char* key : {"charts", "tiles"}) {
    for (const json& count : {json(0), json(2), json(1U << 17), json(1U << 18), json("1"), json(-1)})
      EXPECT_FALSE(reads_after([&](json& j) { felt(j)["displacement"][key] = count; })) << key << count;
  }
  EXPECT_FALSE(reads_after([&](json& j) { felt(j)["displacement"]["scale_m"] = 0; }));
  EXPECT_FALSE(reads_after([&](json& j) { felt(j)["mass"]["inertia_kg_m2"] = {1, 2, 3}; }));
  EXPECT_FALSE(reads_after([&](json& j) { felt(j)["material"].erase("static_friction"); }));
  EXPECT_FALSE(reads_after([](json& j) { j["bufferViews"][1]["byteOffset"] = 1U << 30; }));
  EXPECT_FALSE(reads_after([](json& j) { j["bufferViews"][1]["buffer"] = 1; }));
  EXPECT_FALSE(reads_after([](json& j) { j["meshes"] = json::array(); }));
}

/// Every object has the members that the schema requires, and none that it does not know.
void expect_as_in_schema(const nlohmann::json& value, const nlohmann::json& schema, const std::string& where) {
  if (schema.contains("items") && value.is_array()) {
    for (const auto& item : value) expect_as_in_schema(item, schema["items"], where + "[]");
  }
  if (!schema.contains("properties")) return;
  ASSERT_TRUE(value.is_object()) << where;
  for (const auto& key : schema["required"]) EXPECT_TRUE(value.contains(key)) << where << " lacks " << key;
  for (const auto& [key, member] : value.items()) {
    ASSERT_TRUE(schema["properties"].contains(key)) << where << " has " << key;
    expect_as_in_schema(member, schema["properties"][key], where + "." + key);
  }
}

TEST(AssetTest, IsWrittenAsTheSchemaSays) {
  std::ifstream file(FARFEEL_ASSET_SCHEMA);
  const nlohmann::json schema = nlohmann::json::parse(file);
  const std::vector<std::byte> bytes = write_asset(plate_asset()).value();
  expect_as_in_schema(split_glb(bytes).value().json["extensions"]["FARFEEL_haptic_surface"], schema, "");
}

TEST(AssetTest, SaysMassAndFrictionToOthersToo) {
  const std::vector<std::byte> bytes = write_asset(plate_asset()).value();
  const nlohmann::json gltf = split_glb(bytes).value().json;
  const nlohmann::json& motion = gltf["nodes"][0]["extensions"]["KHR_physics_rigid_bodies"]["motion"];
  EXPECT_EQ(motion["mass"], plate_asset().mass_kg);
  double trace = 0;
  for (const auto& moment : motion["inertiaDiagonal"]) trace += moment.get<double>();
  EXPECT_NEAR(trace, 5.5e-5, 1e-12);
  EXPECT_EQ(gltf["extensions"]["KHR_physics_rigid_bodies"]["physicsMaterials"][0]["staticFriction"], 0.3);
}

TEST(AssetTest, SurvivesEveryTruncationAndManyFlippedBytes) {
  const std::vector<std::byte> bytes = write_asset(plate_asset(kSmall)).value();
  for (std::size_t length = 0; length < bytes.size(); length += 1 + length / 50) {
    EXPECT_FALSE(read_asset(std::span(bytes).first(length)));
  }
  std::mt19937 random(3);
  for (int i = 0; i < 300; ++i) {
    std::vector<std::byte> spoilt = bytes;
    for (int k = 0; k < 3; ++k) spoilt[random() % spoilt.size()] ^= static_cast<std::byte>(1 + random() % 255);
    (void)read_asset(spoilt);  // whatever comes, it comes back
  }
}

}  // namespace
}  // namespace farfeel::codecs
