// Every shape that people bring, in every format: what becomes of it, what is told of it, and how much it encloses,
// does not depend on the format.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "codecs/mesh/glb.h"
#include "slave_sim/bake/given_mesh.h"
#include "tests/support/bad_meshes.h"
#include "tests/support/private_folder.h"

namespace farfeel::slave_sim {
namespace {

using geometry::TriangleMesh;
using support::BadMesh;

std::string bytes_of(const void* values, std::size_t size) {
  return {static_cast<const char*>(values), size};
}

std::string obj(const TriangleMesh& mesh) {
  std::string text;
  for (const glm::dvec3& p : mesh.positions_O) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  for (const auto& [a, b, c] : mesh.triangles) text += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return text;
}

std::string off(const TriangleMesh& mesh) {
  std::string text = fmt::format("OFF\n{} {} 0\n", mesh.positions_O.size(), mesh.triangles.size());
  for (const glm::dvec3& p : mesh.positions_O) text += fmt::format("{} {} {}\n", p.x, p.y, p.z);
  for (const auto& [a, b, c] : mesh.triangles) text += fmt::format("3 {} {} {}\n", a, b, c);
  return text;
}

std::string ply(const TriangleMesh& mesh) {
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.positions_O.size(), mesh.triangles.size());
  for (const glm::dvec3& p : mesh.positions_O) text += bytes_of(&p[0], 3 * sizeof(double));
  for (const geometry::Triangle& t : mesh.triangles) text += '\3' + bytes_of(t.data(), sizeof t);
  return text;
}

std::string stl(const TriangleMesh& mesh) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  std::string text = std::string(80, ' ') + bytes_of(&count, sizeof count);
  for (const geometry::Triangle& t : mesh.triangles) {
    text += std::string(3 * sizeof(float), '\0');
    for (const std::uint32_t v : t) {
      const glm::vec3 p(mesh.positions_O[v]);
      text += bytes_of(&p[0], sizeof p);
    }
    text += std::string(2, '\0');
  }
  return text;
}

std::string glb(const TriangleMesh& mesh) {
  std::string binary;
  for (const geometry::Triangle& t : mesh.triangles) binary += bytes_of(t.data(), sizeof t);
  const std::size_t positions_at = binary.size();
  for (const glm::dvec3& p : mesh.positions_O) {
    const glm::vec3 q(p);
    binary += bytes_of(&q[0], sizeof q);
  }
  nlohmann::json gltf;
  gltf["asset"]["version"] = "2.0";
  gltf["scenes"][0]["nodes"] = {0};
  gltf["nodes"][0]["mesh"] = 0;
  gltf["buffers"][0]["byteLength"] = binary.size();
  gltf["bufferViews"] = {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", positions_at}},
                         {{"buffer", 0}, {"byteOffset", positions_at}, {"byteLength", binary.size() - positions_at}}};
  gltf["accessors"] = {
      {{"bufferView", 0}, {"componentType", 5125}, {"type", "SCALAR"}, {"count", 3 * mesh.triangles.size()}},
      {{"bufferView", 1}, {"componentType", 5126}, {"type", "VEC3"}, {"count", mesh.positions_O.size()}}};
  gltf["meshes"][0]["primitives"][0] = {{"attributes", {{"POSITION", 1}}}, {"indices", 0}, {"mode", 4}};
  const auto joined = codecs::joined_glb(gltf, std::as_bytes(std::span(binary)));
  return bytes_of(joined.data(), joined.size());
}

struct Format {
  const char* ending;
  std::string (*write)(const TriangleMesh&);
};
constexpr std::array kFormats{Format{"obj", obj}, Format{"off", off}, Format{"ply", ply}, Format{"stl", stl},
                              Format{"glb", glb}};

std::string all_that_is_told(const GivenMesh& given) {
  std::string all = given.refusal;
  for (const std::string& line : given.told) all += "\n" + line;
  return all;
}

TEST(BadMeshesTest, EveryShapeInEveryFormatIsMendedOrRefusedWithItsWords) {
  const test_support::PrivateFolder folder;
  int looked_at = 0;
  for (const BadMesh& bad : support::bad_meshes()) {
    if (bad.is_large) continue;
    const TriangleMesh mesh = bad.make();
    for (const Format& format : kFormats) {
      SCOPED_TRACE(fmt::format("{}.{}", bad.name, format.ending));
      const std::string path = fmt::format("{}/{}.{}", folder.path(), bad.name, format.ending);
      std::ofstream(path, std::ios::binary) << format.write(mesh);
      const GivenMesh given = given_mesh(path, "m");
      const std::string told = all_that_is_told(given);
      EXPECT_EQ(given.refusal.empty(), bad.is_baked) << told;
      EXPECT_NE(told.find(bad.words), std::string::npos) << told;
      EXPECT_EQ(given.is_sound, bad.words.empty()) << told;
      if (bad.volume_m3 > 0) {
        EXPECT_NEAR(geometry::signed_volume_m3(given.mesh), bad.volume_m3, 1e-6 * bad.volume_m3) << told;
      }
      ++looked_at;
    }
  }
  EXPECT_GE(looked_at, 75);
}

}  // namespace
}  // namespace farfeel::slave_sim
