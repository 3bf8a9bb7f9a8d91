// Broken meshes of every kind in tests/fuzz/mesh/corpus: each repaired with a word, or refused with a reason.
#include "slave_sim/bake/repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "codecs/mesh/mesh_file.h"
#include "slave_sim/bake/mass.h"
#include "slave_sim/bake/self_crossing.h"
#include "slave_sim/models/models.h"
#include "tests/support/solids.h"

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
  expect_refused("huge.obj", "--unit takes metres");
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

/// A box, its triangles facing outwards or not.
void add_box(geometry::TriangleMesh& to, const glm::dvec3& low, const glm::dvec3& size, bool faces_outwards = true) {
  geometry::TriangleMesh box = support::box_mesh(size);
  const auto first = static_cast<std::uint32_t>(to.positions_O.size());
  for (const glm::dvec3& p : box.positions_O) to.positions_O.push_back(low + 0.5 * size + p);
  for (const auto& [a, b, c] : box.triangles)
    to.triangles.push_back({first + a, first + (faces_outwards ? b : c), first + (faces_outwards ? c : b)});
}

/// Volume, and all notes as one text.
std::pair<double, std::string> volume_and_notes(const geometry::TriangleMesh& mesh) {
  const auto fixed = repaired(mesh);
  if (!fixed) return {0, fixed.error().message};
  EXPECT_TRUE(geometry::is_closed_and_oriented(fixed->mesh));
  std::string notes;
  for (const std::string& note : fixed->notes) notes += note + "; ";
  return {geometry::signed_volume_m3(fixed->mesh), notes};
}

TEST(RepairTest, BodiesBesideEachOtherFaceOutwardsWhicheverIsWrong) {
  for (const double second : {0.5, 1.0, 2.0}) {
    for (const bool is_first_right : {true, false}) {
      for (const bool is_second_right : {true, false}) {
        geometry::TriangleMesh mesh;
        add_box(mesh, {0, 0, 0}, {1, 1, 1}, is_first_right);
        add_box(mesh, {2, 0, 0}, glm::dvec3(second), is_second_right);
        const auto [volume, notes] = volume_and_notes(mesh);
        EXPECT_NEAR(volume, 1 + second * second * second, 1e-9) << notes;
        EXPECT_EQ(notes.find("1 shells turned outwards, the first at (") != std::string::npos,
                  is_first_right != is_second_right)
            << notes;
        EXPECT_EQ(notes.find("the whole surface turned") != std::string::npos, !is_first_right && !is_second_right);
      }
    }
  }
}

TEST(RepairTest, ShellsWithinShellsAreCavitiesAndBodiesInTurn) {
  constexpr double kVolume = 64 - 8 + 1;  // a body in a cavity of a body
  for (int facing = 0; facing < 8; ++facing) {
    geometry::TriangleMesh mesh;
    add_box(mesh, {1.5, 1.5, 1.5}, {1, 1, 1}, (facing & 1) != 0);
    add_box(mesh, {0, 0, 0}, {4, 4, 4}, (facing & 2) != 0);
    add_box(mesh, {1, 1, 1}, {2, 2, 2}, (facing & 4) != 0);
    const auto [volume, notes] = volume_and_notes(mesh);
    EXPECT_NEAR(volume, kVolume, 1e-9) << facing << notes;
    EXPECT_EQ(notes == "1 of the shells lie within another as cavities; ", facing == 3) << facing << notes;
  }
}

TEST(RepairTest, ATurnedTriangleOfAHollowBodyLeavesItsCavity) {
  for (std::size_t wrong = 0; wrong < 24; ++wrong) {
    geometry::TriangleMesh mesh;
    add_box(mesh, {0, 0, 0}, {3, 2, 1});
    add_box(mesh, {1, 0.5, 0.25}, {1, 1, 0.5}, false);
    std::swap(mesh.triangles[wrong][1], mesh.triangles[wrong][2]);
    const auto [volume, notes] = volume_and_notes(mesh);
    EXPECT_NEAR(volume, 6 - 0.5, 1e-9) << notes;
    EXPECT_EQ(notes.find("1 triangles turned to agree with their neighbours, the first at ("), 0U) << notes;
    EXPECT_EQ(notes.find("shells turned"), std::string::npos) << notes;
  }
}

TEST(RepairTest, BodiesThatPassThroughEachOtherAreNotWithinEachOther) {
  geometry::TriangleMesh mesh;
  add_box(mesh, {0, 0, 0}, {2, 2, 2});
  add_box(mesh, {1, 0.5, 0.5}, {2, 1, 1}, false);
  const auto [volume, notes] = volume_and_notes(mesh);
  EXPECT_NEAR(volume, 8 + 2, 1e-9) << notes;
}

TEST(RepairTest, SolidsThatShareAnEdgeGetEachTheirOwn) {
  geometry::TriangleMesh cubes;  // as OpenSCAD leaves stairs: along an edge, and along a line of two edges
  add_box(cubes, {0, 0, 0}, {1, 1, 1});
  add_box(cubes, {1, 1, 0}, {1, 1, 1});
  const auto [volume, notes] = volume_and_notes(cubes);
  EXPECT_NEAR(volume, 2, 1e-9);
  EXPECT_NE(notes.find("1 edges that solids shared parted"), std::string::npos) << notes;
  add_box(cubes, {0, 0, 1}, {1, 1, 1});  // the line goes on
  add_box(cubes, {1, 1, 1}, {1, 1, 1});
  const auto [more, other_notes] = volume_and_notes(cubes);
  EXPECT_NEAR(more, 4, 1e-9) << other_notes;
}

TEST(RepairTest, AWallBetweenTwoSolidsDropsOut) {
  geometry::TriangleMesh cubes;
  add_box(cubes, {0, 0, 0}, {1, 1, 1});
  add_box(cubes, {1, 0, 0}, {1, 1, 1});
  EXPECT_NEAR(volume_and_notes(cubes).first, 2, 1e-9);
  EXPECT_TRUE(repaired(cubes)->left_out.triangles.empty()) << "nobody feels what is within";
}

/// A triangle, and one the other way unless it is single.
void add_sheet(geometry::TriangleMesh& to, const std::array<glm::dvec3, 3>& corners, bool is_doubled) {
  const auto first = static_cast<std::uint32_t>(to.positions_O.size());
  to.positions_O.insert(to.positions_O.end(), corners.begin(), corners.end());
  to.triangles.push_back({first, first + 1, first + 2});
  if (is_doubled) to.triangles.push_back({first, first + 2, first + 1});
}

TEST(RepairTest, WhatIsDroppedOutsideIsLeftOutAndToldWhere) {
  geometry::TriangleMesh speck;
  add_box(speck, {0, 0, 0}, {1, 1, 1});
  add_box(speck, {2, 0, 0}, {0.01, 0.01, 0.01});
  add_box(speck, {0.5, 0.5, 0.5}, {0.01, 0.01, 0.01});  // within
  const auto without = repaired(speck);
  ASSERT_TRUE(without) << without.error().message;
  EXPECT_FALSE(without->was_sound);
  EXPECT_EQ(without->left_out.triangles.size(), 12U);
  EXPECT_GE(geometry::bounding_box(without->left_out).low.x, 2);
  EXPECT_NE(
      without->notes.at(0).find("2 specks (loose shells of almost no area) dropped, the first at (2, 0.00333333, "),
      std::string::npos)
      << without->notes.at(0);

  geometry::TriangleMesh folded;
  add_box(folded, {0, 0, 0}, {1, 1, 1});
  add_sheet(folded, {glm::dvec3(0, 0, 1), {0.02, 0, 1}, {0.01, 0, 1.01}}, true);
  EXPECT_EQ(repaired(folded)->left_out.triangles.size(), 1U);
}

/// A narrow box, beside another, has a third triangle on the edge from (0, 0, 1) to (0.02, 0, 1).
TEST(RepairTest, ASmallFinIsDroppedAndALargeOneRefused) {
  const auto with_fin = [](double height) {
    geometry::TriangleMesh mesh;
    add_box(mesh, {0, 0, 0}, {0.02, 1, 1});
    add_box(mesh, {3, 0, 0}, {1, 1, 1});
    add_sheet(mesh, {glm::dvec3(0, 0, 1), {0.02, 0, 1}, {0.01, 0, 1 + height}}, false);
    return repaired(mesh);
  };
  const auto small = with_fin(0.01), large = with_fin(0.9);
  ASSERT_TRUE(small) << small.error().message;
  EXPECT_EQ(small->notes.at(1).find("1 fins (sheets that hang on an edge) dropped, the first at (0.01, 0, "), 0U)
      << small->notes.at(1);
  EXPECT_EQ(small->left_out.triangles.size(), 1U);
  ASSERT_FALSE(large);
  EXPECT_NE(large.error().message.find("3 triangles meet in one edge at ("), std::string::npos);
}

TEST(RepairTest, JoiningWhatAFormatRepeatsIsNoRepair) {
  EXPECT_TRUE(repaired(corpus("soup.stl"))->was_sound);
  EXPECT_TRUE(repaired(corpus("cube_of_quads.obj"))->was_sound);
  EXPECT_FALSE(repaired(corpus("doubled.obj"))->was_sound);
  geometry::TriangleMesh apart;
  add_box(apart, {0, 0, 0}, {1, 1, 1});
  const geometry::TriangleMesh whole = apart;
  apart.positions_O.push_back(apart.positions_O[0] + glm::dvec3(1e-7, 0, 0));
  for (std::size_t i = 0; i < 12; i += 5) {
    for (std::uint32_t& v : apart.triangles[i]) v = v == 0 ? 8 : v;
  }
  const auto joined = repaired(apart);
  ASSERT_TRUE(joined) << joined.error().message;
  EXPECT_FALSE(joined->was_sound);
  EXPECT_NE(joined->notes.at(0).find("1 corners joined with others nearer than 1.7 um, the first at ("),
            std::string::npos)
      << joined->notes.at(0);
}

/// What had been found by then is told with a refusal, too.
TEST(RepairTest, ARefusalTellsWhatWasMendedBefore) {
  geometry::TriangleMesh open = corpus("open.obj");
  open.triangles.push_back(open.triangles[0]);
  const auto refused = repaired(open);
  ASSERT_FALSE(refused);
  ASSERT_EQ(refused.error().notes.size(), 1U);
  EXPECT_NE(refused.error().notes[0].find("1 doubled triangles dropped, the first at ("), std::string::npos);
}

TEST(RepairTest, BordersThatMeetInTJunctionsAreClosed) {
  for (const int points : {1, 2, 5}) {
    geometry::TriangleMesh box = support::box_mesh({1, 1, 1});
    const auto [a, b, c] = box.triangles[0];  // its edge a -> b gets points that its neighbour does not have
    box.triangles.erase(box.triangles.begin());
    std::uint32_t from = a;
    for (int i = 1; i <= points; ++i) {
      const double along = i / (points + 1.0);
      box.positions_O.push_back((1 - along) * box.positions_O[a] + along * box.positions_O[b]);
      const auto to = static_cast<std::uint32_t>(box.positions_O.size() - 1);
      box.triangles.push_back({from, to, c});
      from = to;
    }
    box.triangles.push_back({from, b, c});
    const auto [volume, notes] = volume_and_notes(box);
    EXPECT_NEAR(volume, 1, 1e-9) << notes;
    EXPECT_NE(notes.find(std::to_string(points) + " edges cut"), std::string::npos) << notes;
  }
}

/// Of a box that is open at the top: filled, or a wall that is so thick, and told.
TEST(RepairTest, WhatIsOpenIsFilledOrMadeThickAsItIsSaid) {
  geometry::TriangleMesh open = support::box_mesh({0.04, 0.04, 0.02});
  std::erase_if(open.triangles, [&](const geometry::Triangle& t) {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return open.positions_O[v].z > 0; });
  });
  const auto unsaid = repaired(open);
  ASSERT_FALSE(unsaid);
  EXPECT_NE(unsaid.error().message.find("--close"), std::string::npos) << unsaid.error().message;
  EXPECT_FALSE(repaired(open, 1, {.widest_m = 0.05, .thickness_m = {}})) << "it is 56 mm across";

  const auto filled = repaired(open, 1, {.widest_m = 0.06, .thickness_m = {}});
  ASSERT_TRUE(filled) << filled.error().message;
  EXPECT_NEAR(geometry::signed_volume_m3(filled->mesh), 32e-6, 1e-12);
  EXPECT_FALSE(filled->was_sound);

  for (const bool is_facing_inwards : {false, true}) {
    geometry::TriangleMesh given = open;
    for (geometry::Triangle& t : given.triangles) {
      if (is_facing_inwards) std::swap(t[1], t[2]);
    }
    const auto thick = repaired(given, 1, {.widest_m = {}, .thickness_m = 1e-4});
    ASSERT_TRUE(thick) << thick.error().message;
    EXPECT_TRUE(geometry::is_closed_and_oriented(thick->mesh));
    const double area_m2 = 0.04 * 0.04 + 4 * 0.04 * 0.02;
    EXPECT_NEAR(geometry::signed_volume_m3(thick->mesh), area_m2 * 1e-4, 0.01 * area_m2 * 1e-4);
    ASSERT_FALSE(thick->notes.empty());
    EXPECT_NE(thick->notes.back().find("1 open sheets made 0.1 mm thick"), std::string::npos) << thick->notes.back();
  }
}

TEST(RepairTest, WhateverIsMadeThickIsClosedOrRefused) {
  int thick = 0;
  for (const auto& entry : std::filesystem::directory_iterator(FARFEEL_MESH_CORPUS)) {
    const auto mesh = codecs::read_mesh_file(entry.path());
    if (!mesh) continue;
    const auto made = repaired(*mesh, 1, {.widest_m = {}, .thickness_m = 1e-2});
    if (!made) continue;
    EXPECT_TRUE(geometry::is_closed_and_oriented(made->mesh)) << entry.path();
    thick += std::any_of(made->notes.begin(), made->notes.end(),
                         [](const std::string& note) { return note.find("open sheets") != std::string::npos; })
                 ? 1
                 : 0;
  }
  EXPECT_GT(thick, 0);
}

/// Both borders go through the corner: each sheet gets walls of its own there.
TEST(RepairTest, SheetsThatTouchInACornerAreMadeThickEach) {
  geometry::TriangleMesh mesh;
  mesh.positions_O = {{0, 0, 0},       {0.02, 0, 0},    {0.02, 0.02, 0}, {0, 0.02, 0},
                      {0.04, 0.02, 0}, {0.04, 0.04, 0}, {0.02, 0.04, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {2, 4, 5}, {2, 5, 6}};
  const auto thick = repaired(mesh, 1, {.widest_m = {}, .thickness_m = 1e-3});
  ASSERT_TRUE(thick) << thick.error().message;
  EXPECT_TRUE(geometry::is_closed_and_oriented(thick->mesh));
  EXPECT_NEAR(geometry::signed_volume_m3(thick->mesh), 2 * 0.02 * 0.02 * 1e-3, 1e-12);
}

TEST(RepairTest, FarFromTheOriginItIsTheSame) {
  geometry::TriangleMesh mesh;
  add_box(mesh, {-2.5e6, -4.7e6, 3.5e6}, {1, 1, 1}, false);
  const auto fixed = repaired(mesh);
  ASSERT_TRUE(fixed) << fixed.error().message;
  EXPECT_NEAR(mass_properties(fixed->mesh, 1).mass_kg, 1, 1e-6);
}

TEST(RepairTest, TheUnitIsApplied) {
  const auto mesh = repaired(corpus("in_millimetres.obj"), 0.001);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_NEAR(geometry::signed_volume_m3(mesh->mesh), 1e-3 / 6, 1e-9);
}

}  // namespace
}  // namespace farfeel::slave_sim
