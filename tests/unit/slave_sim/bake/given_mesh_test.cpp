// One line about everything, and one answer: is it sound?
#include "slave_sim/bake/given_mesh.h"

#include <gtest/gtest.h>

#include <fstream>

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

}  // namespace
}  // namespace farfeel::slave_sim
