// One line about everything, and one answer: is it sound?
#include "slave_sim/bake/given_mesh.h"

#include <gtest/gtest.h>

#include <fstream>

#include "slave_sim/bake/up_axis.h"
#include "tests/support/private_folder.h"

namespace farfeel::slave_sim {
namespace {

std::string corpus(const std::string& name) {
  return std::string(FARFEEL_MESH_CORPUS) + "/" + name;
}

std::string lines_of(const GivenMesh& mesh) {
  std::string lines;
  for (const std::string& line : mesh.told) lines += line + "\n";
  return lines;
}

TEST(GivenMeshTest, WhatIsWholeIsSoundInEveryFormat) {
  for (const char* name : {"tetrahedron.obj", "tetrahedron.ply", "tetrahedron.stl", "cube_of_quads.obj", "soup.stl"}) {
    const GivenMesh mesh = given_mesh(corpus(name), "m");
    EXPECT_TRUE(mesh.is_sound) << name << ": " << lines_of(mesh) << mesh.refusal;
    EXPECT_NE(lines_of(mesh).find("size: 1 x 1 x 1 m, one unit of the file being m"), std::string::npos);
    EXPECT_FALSE(mesh.mesh.triangles.empty());
  }
}

TEST(GivenMeshTest, WhatIsMendedOrDoubtfulIsToldWithItsPlace) {
  const std::pair<const char*, const char*> expected[] = {
      {"inside_out.obj", "repaired: the whole surface turned"},
      {"one_turned.obj", "repaired: 1 triangles turned to agree with their neighbours, the first at ("},
      {"doubled.obj", "repaired: 1 doubled triangles dropped, the first at ("},
      {"degenerate.obj", "repaired: 1 degenerate triangles dropped, the first at ("},
      {"speck.obj", "repaired: 1 specks (loose shells of almost no area) dropped, the first at ("},
      {"touching_in_a_point.obj", "touched itself in a point, the first at ("},
      {"crossing_shells.obj", "mind: the surface passes through itself (12 edges pierce it; the first near ("}};
  for (const auto& [name, words] : expected) {
    const GivenMesh mesh = given_mesh(corpus(name), "m");
    EXPECT_FALSE(mesh.is_sound) << name;
    EXPECT_EQ(mesh.refusal, "") << name;
    EXPECT_NE(lines_of(mesh).find(words), std::string::npos) << name << ": " << lines_of(mesh);
  }
}

TEST(GivenMeshTest, WhatIsRefusedHasTheFilesName) {
  for (const char* name : {"nan.obj", "three_at_an_edge.obj", "open.obj", "moebius.obj", "no_such_file.obj"}) {
    const GivenMesh mesh = given_mesh(corpus(name), "m");
    EXPECT_FALSE(mesh.is_sound);
    EXPECT_NE(mesh.refusal.find(name), std::string::npos) << mesh.refusal;
    EXPECT_TRUE(mesh.mesh.triangles.empty());
  }
}

TEST(GivenMeshTest, AUnitIsAskedForOrGuessed) {
  const GivenMesh asked = given_mesh(corpus("in_millimetres.obj"), "");
  EXPECT_NE(asked.refusal.find("--unit mm"), std::string::npos) << asked.refusal;
  const GivenMesh guessed = given_mesh(corpus("in_millimetres.obj"), "", UnitUnsaid::kIsGuessed);
  EXPECT_EQ(guessed.refusal, "");
  EXPECT_FALSE(guessed.is_sound);
  EXPECT_NE(lines_of(guessed).find("size: 100 x 100 x 100 mm, one unit of the file being mm"), std::string::npos)
      << lines_of(guessed);
}

TEST(GivenMeshTest, SliversAreKeptAndCounted) {
  const test_support::PrivateFolder folder;
  const std::string file = folder / "sliver.obj";
  // A box whose lid has a point almost on its edge.
  std::ofstream(file)
      << "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\nv 0 0 0.1\nv 0.1 0 0.1\nv 0.1 0.1 0.1\nv 0 0.1 0.1\n"
         "v 0.05 0.00001 0.1\nf 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
         "f 5 6 9\nf 6 7 9\nf 7 8 9\nf 8 5 9\n";
  const GivenMesh mesh = given_mesh(file, "m");
  EXPECT_EQ(mesh.refusal, "");
  EXPECT_NE(
      lines_of(mesh).find("mind: 1 slivers (lower than a thousandth of their longest side) are kept, the first at "
                          "(0, 0, 0.1) m"),
      std::string::npos)
      << lines_of(mesh);
  EXPECT_FALSE(mesh.is_sound);
}

/// A tripod, 3 long in x, 2 in y and 1 in z.
void write_tripod(const std::string& file) {
  std::ofstream(file) << "v 0 0 0\nv 3 0 0\nv 0 2 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
}

TEST(GivenMeshTest, WhatIsSaidToPointUpIsTheSceneZ) {
  const test_support::PrivateFolder folder;
  const std::string file = folder / "tripod.obj";
  write_tripod(file);
  const std::pair<const char*, glm::dvec3> expected[] = {
      {"", {3, 2, 1}}, {"z", {3, 2, 1}}, {"y", {3, 1, 2}}, {"x", {2, 1, 3}}};
  for (const auto& [up, size] : expected) {
    const GivenMesh mesh = given_mesh(file, "m", UnitUnsaid::kIsAsked, {}, {}, up);
    EXPECT_TRUE(mesh.is_sound) << up << lines_of(mesh) << mesh.refusal;  // turned, not mirrored
    EXPECT_EQ(geometry::bounding_box(mesh.mesh).size(), size) << up;
    EXPECT_EQ(geometry::bounding_box(mesh.in_file).high.z, size.z) << up;
    EXPECT_EQ(geometry::bounding_box(mesh.in_file).low.z, 0) << up;
  }
  for (const char* wrong : {"", "w", "Z", "-z", "xy"}) EXPECT_NE(complaint_about_axis(wrong), "") << wrong;
}

/// A part's corners stand where those of the whole file do.
TEST(GivenMeshTest, PartsAreTurnedAsTheWholeIs) {
  const glm::dquat R = glm::normalize(glm::dquat(0.4, -0.2, 0.7, 0.1));
  for (const std::string up : {"x", "y", "z"}) {
    codecs::MeshInFile whole;
    codecs::MeshParts parts{.shapes = {}, .parts = {{.name = "part", .shape = 0, .R = R, .p = {1, 2, 3}}}};
    const glm::dvec3 corner(0.3, -0.5, 0.8);
    whole.positions_O = {R * corner + glm::dvec3(1, 2, 3)};
    turn_up(whole, up), turn_up(parts, up);
    const codecs::MeshPart& part = parts.parts.front();
    EXPECT_LT(glm::length(part.R * corner + part.p - whole.positions_O.front()), 1e-14) << up;
  }
}

}  // namespace
}  // namespace farfeel::slave_sim
