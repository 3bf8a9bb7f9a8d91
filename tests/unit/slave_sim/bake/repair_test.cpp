// Broken meshes of every kind in tests/fuzz/mesh/corpus: each repaired with a word, or refused with a reason.
#include "slave_sim/bake/repair.h"

#include <gtest/gtest.h>

#include "codecs/mesh/mesh_file.h"
#include "slave_sim/bake/self_crossing.h"
#include "slave_sim/models/models.h"

namespace farfeel::slave_sim {
namespace {

geometry::TriangleMesh corpus(const std::string& name) {
  const auto mesh = codecs::read_mesh_file(std::filesystem::path(FARFEEL_MESH_CORPUS) / name);
  EXPECT_TRUE(mesh) << mesh.error().message;
  return mesh.value_or(codecs::MeshInFile());
}

/// Repairs and checks the volume and that some note has the words.
void expect_repaired(const std::string& name, double volume_m3, const std::string& words) {
  SCOPED_TRACE(name);
  const auto repaired_mesh = repaired(corpus(name));
  ASSERT_TRUE(repaired_mesh) << repaired_mesh.error().message;
  EXPECT_TRUE(geometry::is_closed_and_oriented(repaired_mesh->mesh));
  EXPECT_NEAR(geometry::signed_volume_m3(repaired_mesh->mesh), volume_m3, 1e-6);
  std::string notes;
  for (const std::string& note : repaired_mesh->notes) notes += note + "; ";
  if (words.empty()) {
    EXPECT_EQ(notes, "");
  } else {
    EXPECT_NE(notes.find(words), std::string::npos) << notes;
  }
}

void expect_refused(const std::string& name, const std::string& words) {
  SCOPED_TRACE(name);
  const auto result = repaired(corpus(name));
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message.find(words), std::string::npos) << result.error().message;
}

TEST(RepairTest, WhatIsWholeStaysAsItIs) {
  expect_repaired("tetrahedron.obj", 1.0 / 6, "");
  expect_repaired("tetrahedron.ply", 1.0 / 6, "");
  expect_repaired("cube_of_quads.obj", 1, "");
  expect_repaired("two_shells.obj", 2.0 / 6, "");
  expect_repaired("crossing_shells.obj", 2, "");
}

TEST(RepairTest, WhatCanBeMendedIsMendedWithAWord) {
  expect_repaired("tetrahedron.stl", 1.0 / 6, "8 corners joined");
  expect_repaired("soup.stl", 1, "28 corners joined");
  expect_repaired("inside_out.obj", 1.0 / 6, "inwards");
  expect_repaired("one_turned.obj", 1.0 / 6, "1 triangles turned");
  expect_repaired("doubled.obj", 1.0 / 6, "1 doubled");
  expect_repaired("degenerate.obj", 1.0 / 6, "1 degenerate");
  expect_repaired("speck.obj", 1.0 / 6, "1 specks");
  expect_repaired("touching_in_a_point.obj", 2.0 / 6, "touched itself");
  expect_repaired("sliver.obj", 1.0 / 6, "");
}

TEST(RepairTest, WhatCannotIsRefusedWithAReason) {
  EXPECT_FALSE(repaired({}));
  expect_refused("nan.obj", "not a finite number");
  expect_refused("huge.obj", "--unit");
  expect_refused("in_millimetres.obj", "--unit mm");
  expect_refused("three_at_an_edge.obj", "3 triangles meet");
  expect_refused("open.obj", "opening");
  expect_refused("moebius.obj", "one side");
  expect_refused("far_away.obj", "opening");
}

TEST(SelfCrossingTest, IsToldOfCrossingShellsAndOfNothingWhole) {
  const auto crossings = [](const std::string& name) { return self_crossing(repaired(corpus(name)).value().mesh); };
  const SelfCrossing found = crossings("crossing_shells.obj");
  EXPECT_EQ(found.edges, 12U);  // three edges and three diagonals of either cube end inside the other
  EXPECT_EQ(found.looked, found.of);
  EXPECT_NE(words_about(found).value().find("passes through itself (12 edges"), std::string::npos);
  const SelfCrossing one = crossings("self_intersecting.obj");
  EXPECT_GT(one.edges, 0U);
  for (const char* name : {"tetrahedron.obj", "cube_of_quads.obj", "two_shells.obj", "touching_in_a_point.obj",
                           "sliver.obj", "one_turned.obj"}) {
    EXPECT_EQ(crossings(name).edges, 0U) << name;
    EXPECT_FALSE(words_about(crossings(name))) << name;
  }
  EXPECT_EQ(self_crossing(gear_mesh()).edges, 0U);
  EXPECT_EQ(self_crossing(helicoidal_torus_mesh()).edges, 0U);
}

TEST(SelfCrossingTest, ALargeMeshIsSampledAndSaysSo) {
  geometry::TriangleMesh two = helicoidal_torus_mesh();  // and another, pushed half through it
  const auto count = static_cast<std::uint32_t>(two.positions_O.size());
  const geometry::TriangleMesh one = two;
  for (const glm::dvec3& p : one.positions_O) two.positions_O.push_back(p + glm::dvec3(0.01, 0, 0));
  for (const auto& [a, b, c] : one.triangles) two.triangles.push_back({a + count, b + count, c + count});
  const SelfCrossing found = self_crossing(two, 20'000);
  EXPECT_GT(found.edges, 0U);
  EXPECT_LE(found.looked, 20'000U);
  EXPECT_NE(words_about(found).value().find("that were looked at out of"), std::string::npos);
}

TEST(RepairTest, TheUnitIsApplied) {
  const auto mesh = repaired(corpus("in_millimetres.obj"), 0.001);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_NEAR(geometry::signed_volume_m3(mesh->mesh), 1e-3 / 6, 1e-9);
}

}  // namespace
}  // namespace farfeel::slave_sim
