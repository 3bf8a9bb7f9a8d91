#include "master_station/session/scene_apart.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace farfeel::master_station {
namespace {

using codecs::CodedMesh;

geometry::TriangleMesh sheet(std::uint32_t n) {
  geometry::TriangleMesh mesh;
  for (std::uint32_t i = 0; i <= n; ++i)
    for (std::uint32_t j = 0; j <= n; ++j)
      mesh.positions_O.emplace_back(0.1 * i / n, 0.1 * j / n, 0.01 * std::sin(i + j));
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const std::uint32_t a = i * (n + 1) + j, b = a + n + 1;
      mesh.triangles.push_back({a, b, b + 1});
      mesh.triangles.push_back({a, b + 1, a + 1});
    }
  }
  return mesh;
}
CodedMesh coded(const geometry::TriangleMesh& mesh, const std::vector<std::byte>& bitstream) {
  return {static_cast<std::uint32_t>(mesh.triangles.size()), bitstream};
}

TEST(SceneApart, IsWhatIsDecodedHere) {
  const geometry::TriangleMesh small = sheet(3), large = sheet(150);
  const auto small_bits = codecs::write_draco(small).value(), large_bits = codecs::write_draco(large).value();
  const std::vector<CodedMesh> both{coded(small, small_bits), coded(large, large_bits)};
  const auto here = codecs::decode_meshes(both), apart = decode_meshes_apart(FARFEEL_MASTER)(both);
  ASSERT_TRUE(apart) << apart.error();
  ASSERT_EQ(apart->size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_TRUE((*apart)[i].positions_O == (*here)[i].positions_O) << i;
    EXPECT_TRUE((*apart)[i].triangles == (*here)[i].triangles) << i;
  }
}

// Whatever is in the bitstream: what comes is meshes or a reason, the same as here, and nobody dies.
TEST(SceneApart, OfChangedBytesEndsWithMeshesOrAReason) {
  const geometry::TriangleMesh mesh = sheet(12);
  const auto bits = codecs::write_draco(mesh).value();
  const auto decode = decode_meshes_apart(FARFEEL_MASTER);
  std::mt19937 random(3);
  int refused = 0;
  for (int i = 0; i < 40; ++i) {
    auto bent = bits;
    for (int n = 0; n < 3; ++n) bent[11 + random() % (bent.size() - 11)] = static_cast<std::byte>(random());
    const std::vector<CodedMesh> one{coded(mesh, bent)};
    const auto here = codecs::decode_meshes(one), apart = decode(one);
    ASSERT_EQ(here.has_value(), apart.has_value()) << (here ? apart.error() : here.error());
    if (here) continue;
    EXPECT_EQ(apart.error(), here.error());
    ++refused;
  }
  EXPECT_GT(refused, 0);
}

// Half a million triangles take 20 times the memory of their bitstream, within the wire's bounds. What is allowed is
// lowered here instead, below what they need.
TEST(SceneApart, ThatNeedsMoreMemoryThanAllowedIsToldSo) {
#ifdef FARFEEL_SANITIZED
  GTEST_SKIP() << "sanitizers reserve terabytes of addresses: no limit of memory holds beside them";
#endif
  const geometry::TriangleMesh mesh = sheet(500);
  const auto bits = codecs::write_draco(mesh).value();
  const std::vector<CodedMesh> one{coded(mesh, bits)};
  const auto refused = decode_meshes_apart(FARFEEL_MASTER, {30'000'000, 30, 0})(one);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().find("memory"), std::string::npos) << refused.error();
  EXPECT_TRUE(decode_meshes_apart(FARFEEL_MASTER)(one)) << "within the limit that masters have";
}

TEST(SceneApart, OfAProgramThatIsNotThereIsToldSo) {
  const geometry::TriangleMesh mesh = sheet(3);
  const auto bits = codecs::write_draco(mesh).value();
  const std::vector<CodedMesh> one{coded(mesh, bits)};
  EXPECT_FALSE(decode_meshes_apart("/no/such/master")(one));
  EXPECT_FALSE(decode_meshes_apart("/bin/true")(one)) << "says nothing";
}

}  // namespace
}  // namespace farfeel::master_station
