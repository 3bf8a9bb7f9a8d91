#include "codecs/scene/mesh_messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace farfeel::codecs {
namespace {

/// n x n squares, with heights that are no f32.
ColouredMesh sheet(std::uint32_t n) {
  ColouredMesh mesh;
  for (std::uint32_t i = 0; i <= n; ++i)
    for (std::uint32_t j = 0; j <= n; ++j) mesh.positions_O.emplace_back(0.1 * i, 0.1 * j, 0.01 * (i * j % 7));
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const std::uint32_t a = i * (n + 1) + j, b = a + n + 1;
      mesh.triangles.push_back({a, b, b + 1});
      mesh.triangles.push_back({a, b + 1, a + 1});
    }
  }
  return mesh;
}

/// The same, each vertex in a colour of its own.
ColouredMesh coloured_sheet(std::uint32_t n) {
  ColouredMesh mesh = sheet(n);
  for (std::size_t v = 0; v < mesh.positions_O.size(); ++v)
    mesh.colours.push_back({static_cast<std::uint8_t>(v), static_cast<std::uint8_t>(v / 256), 7});
  return mesh;
}

struct Coded {
  explicit Coded(const std::vector<ColouredMesh>& meshes) {
    for (const auto& mesh : meshes) bitstreams.push_back(write_draco(mesh, kPositionBits, mesh.colours).value());
    for (std::size_t i = 0; i < meshes.size(); ++i)
      coded.push_back({static_cast<std::uint32_t>(meshes[i].triangles.size()), bitstreams[i]});
  }
  std::vector<std::vector<std::byte>> bitstreams;
  std::vector<CodedMesh> coded;
};

bool same(const ColouredMesh& a, const ColouredMesh& b) {
  return a.positions_O == b.positions_O && a.triangles == b.triangles && a.colours == b.colours;
}

TEST(MeshMessages, GiveWhatDecodingHereGives) {
  const Coded scene({sheet(1), coloured_sheet(9), sheet(30)});
  const auto question = write_coded(scene.coded);
  const auto asked = read_coded(question);
  ASSERT_TRUE(asked);
  const auto there = decode_meshes(*asked);
  ASSERT_TRUE(there) << there.error();
  const auto answer = write_decoded(*there);
  EXPECT_LE(answer.size(), most_decoded_bytes(scene.coded));
  const auto got = read_decoded(answer, scene.coded);
  ASSERT_TRUE(got) << got.error();
  const auto here = decode_meshes(scene.coded);
  ASSERT_EQ(got->size(), here->size());
  for (std::size_t i = 0; i < here->size(); ++i) EXPECT_TRUE(same((*got)[i], (*here)[i])) << i;
  EXPECT_EQ((*got)[1].colours.size(), 100u);
}

TEST(MeshMessages, CutShortOrLongerAreRefused) {
  const Coded scene({sheet(2), coloured_sheet(3)});
  const auto question = write_coded(scene.coded), answer = write_decoded(*decode_meshes(scene.coded));
  for (std::size_t n = 0; n < question.size(); ++n) EXPECT_FALSE(read_coded(std::span(question).first(n))) << n;
  for (std::size_t n = 0; n < answer.size(); ++n)
    EXPECT_FALSE(read_decoded(std::span(answer).first(n), scene.coded)) << n;
  auto longer_question = question, longer_answer = answer;
  longer_question.emplace_back();
  longer_answer.emplace_back();
  EXPECT_FALSE(read_coded(longer_question));
  EXPECT_FALSE(read_decoded(longer_answer, scene.coded));
}

TEST(MeshMessages, ThatClaimTooMuchAreRefusedBeforeAnythingIsAllocated) {
  const Coded scene({sheet(2)});
  const auto bent = [](std::vector<std::byte> bytes, std::size_t at, std::uint32_t value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
    return bytes;
  };
  const auto question = write_coded(scene.coded), answer = write_decoded(*decode_meshes(scene.coded));
  for (const std::uint32_t many : {kMaxMeshTriangles + 1, 0xFFFF'FFFFu}) {
    EXPECT_FALSE(read_coded(bent(question, 0, many))) << "meshes";
    EXPECT_FALSE(read_coded(bent(question, 4, many))) << "triangles";
    EXPECT_FALSE(read_coded(bent(question, 8, many))) << "bytes";
    EXPECT_FALSE(read_decoded(bent(answer, 0, many), scene.coded)) << "vertices";
    EXPECT_FALSE(read_decoded(bent(answer, 4, many), scene.coded)) << "triangles";
    EXPECT_FALSE(read_decoded(bent(answer, 8, many), scene.coded)) << "colours";
  }
  EXPECT_FALSE(read_coded(bent(question, 4, 0))) << "a mesh of nothing";
}

TEST(MeshMessages, WithAFaultAreRefused) {
  const Coded scene({sheet(2)});
  auto mesh = decode_meshes(scene.coded)->front();
  const auto refused = [&](const ColouredMesh& m) { return !read_decoded(write_decoded({&m, 1}), scene.coded); };
  EXPECT_FALSE(refused(mesh));
  auto out_of_range = mesh, not_finite = mesh, more = mesh, none = mesh, colours = mesh;
  out_of_range.triangles[3][1] = static_cast<std::uint32_t>(mesh.positions_O.size());
  not_finite.positions_O[2].y = std::nan("");
  more.triangles.push_back(more.triangles[0]);
  none.triangles.clear();
  colours.colours.resize(mesh.positions_O.size() - 1);
  EXPECT_TRUE(refused(out_of_range));
  EXPECT_TRUE(refused(not_finite));
  EXPECT_TRUE(refused(more)) << "more triangles than were claimed";
  EXPECT_TRUE(refused(none));
  EXPECT_TRUE(refused(colours)) << "fewer colours than vertices";
  EXPECT_FALSE(read_decoded({}, scene.coded)) << "fewer meshes";
}

TEST(MeshMessages, OfAllMeshesAreBoundedTogether) {
  const std::vector<CodedMesh> most(2, {kMaxMeshTriangles, {}}), more(3, {kMaxMeshTriangles, {}});
  EXPECT_TRUE(read_coded(write_coded(most)));
  EXPECT_FALSE(read_coded(write_coded(more)));
}

}  // namespace
}  // namespace farfeel::codecs
