// What documents of other makers do: no scenes, sparse and quantised accessors, skeletons, morph targets, extensions.
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <cstring>
#include <functional>

#include "codecs/mesh/glb.h"
#include "codecs/mesh/mesh_parts.h"

namespace farfeel::codecs {
namespace {

using nlohmann::json;

template <typename T>
void put(std::vector<std::byte>& out, std::initializer_list<T> values) {
  for (const T value : values) {
    const auto* first = reinterpret_cast<const std::byte*>(&value);
    out.insert(out.end(), first, first + sizeof value);
  }
}

/// A unit tetrahedron under a node that doubles it, at 0; and room for more bytes.
struct Document {
  json gltf;
  std::vector<std::byte> bytes;
  json more_buffers = json::array();

  Document() {
    gltf = json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
      "nodes":[{"scale":[2,2,2],"children":[1]},{"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"accessors":[],"bufferViews":[]})");
    add<float>("VEC3", 5126, 4, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
    add<std::uint8_t>("SCALAR", 5121, 12, {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2});
  }
  template <typename T>
  int view(std::initializer_list<T> values) {
    while (bytes.size() % 4 != 0) bytes.push_back({});
    gltf["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", values.size() * sizeof(T)}});
    put(bytes, values);
    return static_cast<int>(gltf["bufferViews"].size()) - 1;
  }
  template <typename T>
  int add(const char* type, int component, int count, std::initializer_list<T> values) {
    const int at = view(values);
    gltf["accessors"].push_back({{"bufferView", at}, {"componentType", component}, {"count", count}, {"type", type}});
    return static_cast<int>(gltf["accessors"].size()) - 1;
  }
  /// Of the only mesh.
  json& primitive() { return gltf["meshes"][0]["primitives"][0]; }
  MeshResult read() {
    gltf["buffers"] = json::array({{{"byteLength", bytes.size()}}});
    for (const json& buffer : more_buffers) gltf["buffers"].push_back(buffer);
    return read_gltf(joined_glb(gltf, bytes));
  }
};

void expect_volume(Document document, double volume) {
  const MeshResult mesh = document.read();
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 4U);
  EXPECT_NEAR(geometry::signed_volume_m3(*mesh), volume, 1e-5 * volume);
}

void expect_refused(Document document, const std::string& words) {
  const MeshResult mesh = document.read();
  ASSERT_FALSE(mesh) << words;
  EXPECT_NE(mesh.error().message.find(words), std::string::npos) << mesh.error().message;
}

TEST(GltfTest, WithoutScenesWhatIsNobodysChildIsShownOnce) {
  Document document;
  expect_volume(document, 8.0 / 6);
  document.gltf.erase("scene"), document.gltf.erase("scenes");
  expect_volume(document, 8.0 / 6);
  std::swap(document.gltf["nodes"][0], document.gltf["nodes"][1]);  // the child comes first
  document.gltf["nodes"][1]["children"] = {0};
  expect_volume(document, 8.0 / 6);
  document.gltf["scenes"] = json::array();
  expect_volume(document, 8.0 / 6);
  document.gltf.erase("nodes");
  expect_volume(document, 1.0 / 6);
}

TEST(GltfTest, ALongChainOfNodesIsATreeAndARingIsNone) {
  Document document;
  json& nodes = document.gltf["nodes"] = json::array();
  for (int i = 0; i < 300; ++i) nodes.push_back({{"children", {i + 1}}});
  nodes.push_back({{"mesh", 0}});
  expect_volume(document, 1.0 / 6);
  nodes[299]["children"] = {300, 0};
  expect_refused(document, "not a tree");
  nodes[299]["children"] = {300};
  nodes[7]["children"] = {8, 300};
  expect_refused(document, "not a tree");
}

TEST(GltfTest, SparseAccessorsAreFollowed) {
  Document document;
  json& sparse = document.gltf["accessors"][0]["sparse"];
  sparse = {{"count", 1},
            {"indices", {{"bufferView", document.view<std::uint16_t>({3})}, {"componentType", 5123}}},
            {"values", {{"bufferView", document.view<float>({0, 0, 5})}}}};
  expect_volume(document, 5 * 8.0 / 6);
  Document beyond = document;
  beyond.gltf["accessors"][0]["sparse"]["indices"]["bufferView"] = beyond.view<std::uint16_t>({4});
  expect_refused(beyond, "names element 4 of 4");
  beyond = document;
  beyond.gltf["accessors"][0]["sparse"]["count"] = 2;
  expect_refused(beyond, "beyond");
  Document only;
  only.gltf["accessors"][0]["sparse"] = {
      {"count", 4},
      {"indices", {{"bufferView", only.view<std::uint8_t>({0, 1, 2, 3})}, {"componentType", 5121}}},
      {"values", {{"bufferView", only.gltf["accessors"][0]["bufferView"]}}}};
  only.gltf["accessors"][0].erase("bufferView");
  expect_volume(only, 8.0 / 6);
  only.gltf["accessors"][0]["count"] = 1 << 27;
  expect_refused(only, "has no bytes");
}

TEST(GltfTest, QuantisedPositionsAreNumbersOrShares) {
  Document document;
  document.gltf["extensionsRequired"] = {"KHR_mesh_quantization"};
  document.primitive()["attributes"]["POSITION"] =
      document.add<std::int16_t>("VEC3", 5122, 4, {0, 0, 0, 3, 0, 0, 0, 3, 0, 0, 0, 3});
  expect_volume(document, 27 * 8.0 / 6);
  const int small = document.add<std::uint8_t>("VEC3", 5121, 4, {0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255});
  document.gltf["accessors"][small]["normalized"] = true;
  document.primitive()["attributes"]["POSITION"] = small;
  expect_volume(document, 8.0 / 6);
  document.gltf["extensionsRequired"] = {"KHR_texture_transform", "KHR_materials_unlit"};
  expect_volume(document, 8.0 / 6);
  document.gltf["extensionsRequired"] = {"KHR_meshopt_compression"};
  expect_refused(document, "KHR_meshopt_compression");
}

Document skinned() {
  Document document;
  json& attributes = document.primitive()["attributes"];
  attributes["JOINTS_0"] =
      document.add<std::uint8_t>("VEC4", 5121, 4, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0});
  attributes["WEIGHTS_0"] = document.add<float>("VEC4", 5126, 4, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, .5, .5, 0, 0});
  const int matrices = document.add<float>("MAT4", 5126, 2, {100, 0, 0, 0, 0, 100, 0, 0, 0, 0, 100, 0, 0, 0, 0, 1,
                                                             100, 0, 0, 0, 0, 100, 0, 0, 0, 0, 100, 0, 0, 0, 0, 1});
  document.gltf["skins"] = json::array({{{"joints", {2, 3}}, {"inverseBindMatrices", matrices}}});
  document.gltf["nodes"][1]["skin"] = 0;
  document.gltf["nodes"].push_back({{"scale", {0.01, 0.01, 0.01}}});
  document.gltf["nodes"].push_back({{"scale", {0.01, 0.01, 0.01}}, {"translation", {0, 0, 6}}});
  return document;
}

TEST(GltfTest, ColoursOfVerticesAreKeptAsScreensTakeThem) {
  Document document;
  document.primitive()["attributes"]["COLOR_0"] =
      document.add<float>("VEC3", 5126, 4, {1, 0.2159F, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(document.read().value().colours, (std::vector<Colour>{{255, 128, 0}, {}, {}, {}}));
  document.primitive()["attributes"]["COLOR_0"] =
      document.add<std::uint8_t>("VEC4", 5121, 4, {255, 55, 0, 9, 0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 9});
  document.gltf["accessors"][3]["normalized"] = true;
  EXPECT_EQ(document.read().value().colours, (std::vector<Colour>{{255, 128, 0}, {}, {}, {}}));
  document.gltf["meshes"].push_back(document.gltf["meshes"][0]);
  document.gltf["meshes"][1]["primitives"][0]["attributes"].erase("COLOR_0");
  document.gltf["nodes"][0]["mesh"] = 1;  // shown first
  const auto both = document.read().value().colours;
  ASSERT_EQ(both.size(), 8U);
  EXPECT_EQ(both[0], (Colour{255, 255, 255})) << "what has none is white";
  EXPECT_EQ(both[4], (Colour{255, 128, 0}));
  document.gltf["accessors"][3]["count"] = 400;
  expect_refused(document, "beyond its bufferView");
}

TEST(GltfTest, PartsAreNodesWithMeshesEachInItsPlace) {
  Document document;
  document.gltf["nodes"] = json::parse(R"([{"name":"all","children":[1,2,3,4],"translation":[0,0,1]},
    {"name":"left","mesh":0,"scale":[2,2,2],"translation":[5,0,0]},
    {"name":"right","mesh":0,"scale":[2,2,2],"rotation":[0,0,0.70710678118,0.70710678118]},
    {"name":"mirror","mesh":0,"scale":[-1,1,1]},
    {"mesh":0,"scale":[1,1,3]}])");
  document.gltf["buffers"] = json::array({{{"byteLength", document.bytes.size()}}});
  const auto parts = read_gltf_parts(joined_glb(document.gltf, document.bytes));
  ASSERT_TRUE(parts) << parts.error().message;
  ASSERT_EQ(parts->parts.size(), 4U);
  ASSERT_EQ(parts->shapes.size(), 3U) << "left and right are one";
  EXPECT_EQ(parts->parts[0].name + parts->parts[1].name + parts->parts[2].name + parts->parts[3].name,
            "leftrightmirror");
  EXPECT_EQ(parts->parts[0].shape, parts->parts[1].shape);
  for (const auto& [shape, volume] : {std::pair(0, 8.0 / 6), std::pair(1, 1.0 / 6), std::pair(2, 3.0 / 6)})
    EXPECT_NEAR(geometry::signed_volume_m3(parts->shapes[static_cast<std::size_t>(shape)]), volume, 1e-6);
  EXPECT_EQ(parts->parts[0].p, glm::dvec3(5, 0, 1));
  EXPECT_LT(glm::length(parts->parts[1].R * glm::dvec3(1, 0, 0) - glm::dvec3(0, 1, 0)), 1e-6);
  // Put together they are what the file is as a whole.
  geometry::Box box, whole = geometry::bounding_box(document.read().value());
  for (const MeshPart& part : parts->parts) {
    for (const glm::dvec3& p : parts->shapes[part.shape].positions_O) box.include(part.R * p + part.p);
  }
  EXPECT_LT(glm::length(box.low - whole.low) + glm::length(box.high - whole.high), 1e-6);

  json& nodes = document.gltf["nodes"];
  for (std::size_t i = 0; i < kMostParts; ++i) nodes[0]["children"].push_back(nodes.size()), nodes.push_back(nodes[1]);
  EXPECT_FALSE(read_gltf_parts(joined_glb(document.gltf, document.bytes))) << "more than a scene has objects";
}

/// The tetrahedron with its two views packed, and a buffer that stands in for readers that do not unpack.
Document packed_document(bool has_triangles) {
  Document document;
  std::vector<unsigned char> positions(meshopt_encodeVertexBufferBound(4, 12)),
      indices(has_triangles ? meshopt_encodeIndexBufferBound(12, 4) : meshopt_encodeIndexSequenceBound(12, 4));
  const std::array<float, 12> corners{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::array<unsigned, 12> order{0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  positions.resize(meshopt_encodeVertexBuffer(positions.data(), positions.size(), corners.data(), 4, 12));
  indices.resize(has_triangles ? meshopt_encodeIndexBuffer(indices.data(), indices.size(), order.data(), 12)
                               : meshopt_encodeIndexSequence(indices.data(), indices.size(), order.data(), 12));
  document.bytes.clear();
  const auto pack = [&](int view, const std::vector<unsigned char>& bytes, json extension) {
    extension.update({{"buffer", 0}, {"byteOffset", document.bytes.size()}, {"byteLength", bytes.size()}});
    const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
    document.bytes.insert(document.bytes.end(), first, first + bytes.size());
    while (document.bytes.size() % 4 != 0) document.bytes.push_back({});
    document.gltf["bufferViews"][view] = {
        {"buffer", 1}, {"byteLength", view == 0 ? 48 : 24}, {"extensions", {{"EXT_meshopt_compression", extension}}}};
  };
  pack(0, positions, {{"byteStride", 12}, {"count", 4}, {"mode", "ATTRIBUTES"}});
  pack(1, indices, {{"byteStride", 2}, {"count", 12}, {"mode", has_triangles ? "TRIANGLES" : "INDICES"}});
  document.gltf["accessors"][1]["componentType"] = 5123;
  document.gltf["extensionsRequired"] = {"EXT_meshopt_compression"};
  document.more_buffers =
      json::array({{{"byteLength", 72}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}});
  return document;
}

json& packing(Document& document, int view) {
  return document.gltf["bufferViews"][view]["extensions"]["EXT_meshopt_compression"];
}

TEST(GltfTest, ViewsUnderMeshoptCompressionAreUnpacked) {
  expect_volume(packed_document(true), 8.0 / 6);
  expect_volume(packed_document(false), 8.0 / 6);
  Document filtered = packed_document(true);  // 2 for 1: of the three digits behind it, and the exponent's
  std::vector<unsigned char> bytes(meshopt_encodeVertexBufferBound(4, 12));
  const std::array<float, 12> corners{0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2};
  std::array<float, 12> exponential{};
  meshopt_encodeFilterExp(exponential.data(), 4, 12, 15, corners.data());
  bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), exponential.data(), 4, 12));
  packing(filtered, 0)
      .update({{"byteOffset", filtered.bytes.size()}, {"byteLength", bytes.size()}, {"filter", "EXPONENTIAL"}});
  const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
  filtered.bytes.insert(filtered.bytes.end(), first, first + bytes.size());
  expect_volume(filtered, 64.0 / 6);
}

TEST(GltfTest, PackedViewsThatCannotBeAreRefusedBeforeTheyTakeMemory) {
  const auto refused = [](auto spoil, const std::string& words) {
    Document document = packed_document(true);
    spoil(document);
    expect_refused(document, words);
  };
  refused(
      [](Document& d) {
        packing(d, 0)["count"] = 1 << 24;
        d.gltf["bufferViews"][0]["byteLength"] = 12 << 24;
      },
      "no packing is so tight");
  refused([](Document& d) { packing(d, 0)["byteLength"] = packing(d, 0)["byteLength"].get<int>() - 2; }, "unpacked");
  refused([](Document& d) { packing(d, 0)["byteStride"] = 10; }, "its mode does not have");
  refused([](Document& d) { packing(d, 0)["mode"] = "POINTS"; }, "mode or filter");
  refused([](Document& d) { packing(d, 1)["filter"] = "OCTAHEDRAL"; }, "its mode does not have");
  refused([](Document& d) { packing(d, 0)["buffer"] = 7; }, "not there");
  refused([](Document& d) { packing(d, 0)["byteOffset"] = 1000; }, "as it should be");
  refused([](Document& d) { d.gltf["bufferViews"][0]["byteLength"] = 60; }, "another length");
  refused([](Document& d) { d.gltf["bufferViews"][0].erase("extensions"); }, "byteLength");  // of what stands in
  refused(
      [](Document& d) {
        for (int i = 0; i < 3; ++i) d.gltf["bufferViews"].push_back(d.gltf["bufferViews"][0]);
      },
      "share their bytes");
  refused([](Document& d) { d.gltf["extensionsRequired"] = {"KHR_meshopt_compression"}; }, "KHR_meshopt_compression");
  refused([](Document& d) { d.bytes[0] = std::byte{0x7F}; }, "damaged");
}

TEST(GltfTest, ASkinnedMeshStandsWhereItsJointsTakeItAndItsNodeDoesNotCount) {
  Document document = skinned();
  expect_volume(document, (1 + 0.5 * 6) / 6);  // the tip goes half as far as its second joint
  EXPECT_EQ(document.read().value().notes.size(), 1U);
  document.gltf["nodes"][3]["translation"] = {0, 0, 0};
  document.gltf["nodes"][1]["scale"] = {100, 100, 100};
  expect_volume(document, 1.0 / 6);
  document.gltf["skins"][0].erase("inverseBindMatrices");
  expect_volume(document, 1e-6 / 6);
}

TEST(GltfTest, ASkinThatDoesNotFitIsRefused) {
  Document document = skinned();
  document.gltf["skins"][0]["joints"] = {2};
  expect_refused(document, "hangs on joint 1 of 1");
  document.gltf["skins"][0]["joints"] = {2, 3, 0};
  expect_refused(document, "more joints than matrices");
  document.gltf["skins"][0]["joints"] = {2, 99};
  expect_refused(document, "joints");
  document = skinned();
  document.primitive()["attributes"].erase("WEIGHTS_0");
  expect_refused(document, "hangs on no joint");
  document = skinned();
  document.gltf["accessors"][3]["count"] = 3;
  expect_refused(document, "another number of weights");
}

TEST(GltfTest, MorphTargetsCountAsTheyAreWeighted) {
  Document document;
  const int up = document.add<float>("VEC3", 5126, 4, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2});
  document.primitive()["targets"] = json::array({{{"POSITION", up}}, {{"NORMAL", 999}}});
  expect_volume(document, 8.0 / 6);
  document.gltf["meshes"][0]["weights"] = {0.5, 1};
  expect_volume(document, 2 * 8.0 / 6);
  document.gltf["nodes"][1]["weights"] = {1, 0};
  expect_volume(document, 3 * 8.0 / 6);
  document.gltf["accessors"][up]["count"] = 3;
  expect_refused(document, "another number of vertices");
}

TEST(GltfTest, InstancesThatWouldBeLeftOutAreRefused) {
  Document document;
  document.gltf["nodes"][1]["extensions"]["EXT_mesh_gpu_instancing"] = {{"attributes", {{"TRANSLATION", 0}}}};
  expect_refused(document, "EXT_mesh_gpu_instancing");
}

}  // namespace
}  // namespace farfeel::codecs
