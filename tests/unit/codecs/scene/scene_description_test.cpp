#include "codecs/scene/scene_description.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string_view>

#include "codecs/mesh/draco_bounds.h"
#include "codecs/mesh/draco_mesh.h"

namespace farfeel::codecs {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A bumpy closed surface with 2 * rings * sides triangles.
geometry::TriangleMesh torus(std::uint32_t rings, std::uint32_t sides) {
  geometry::TriangleMesh mesh;
  for (std::uint32_t i = 0; i < rings; ++i) {
    for (std::uint32_t j = 0; j < sides; ++j) {
      const double u = 2 * M_PI * i / rings, v = 2 * M_PI * j / sides;
      const double r = 0.02 + 0.001 * std::sin(7 * u + 3 * v), q = 0.06 + r * std::cos(v);
      mesh.positions_O.emplace_back(q * std::cos(u), q * std::sin(u), r * std::sin(v));
      const std::uint32_t a = i * sides + j, b = (i + 1) % rings * sides + j;
      const std::uint32_t c = (i + 1) % rings * sides + (j + 1) % sides, d = i * sides + (j + 1) % sides;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

motion::ScriptedMotion swing() {
  const std::vector<motion::Keyframe> keys{
      {0, {}}, {1, {glm::angleAxis(0.3, glm::dvec3(1, 0, 0)), {0, 0.01, 0}}}, {2, {}}};
  return {keys, motion::Afterwards::kRepeats};
}

SceneDescription scene() {
  SceneDescription s;
  s.name = "file-cad";
  s.objects = {{"CAD part", {glm::angleAxis(0.3, glm::dvec3(0, 0, 1)), {0.1, 0.2, 0.3}}, torus(20, 10)},
               {"second", {}, torus(8, 6), swing()}};
  s.tool.name = "file";
  s.tool.visible_T = torus(12, 8);
  s.tool.mass_kg = 0.25;
  s.tool.inertia_To_T_kg_m2 = glm::dmat3(3e-4, 1e-6, 2e-6, 1e-6, 2e-4, 3e-6, 2e-6, 3e-6, 4e-4);
  s.tool.material = {1500, 0.4, 0.35, 0.2};
  s.exploration.p_TWork_T = {0.1, 0, -0.003};
  s.exploration.nhat_work_T = {0, 0, -1};
  s.exploration.region_low_W = {-0.05, -0.04, 0};
  s.exploration.region_high_W = {0.05, 0.04, 0.06};
  s.exploration.approach_W = glm::normalize(glm::dvec3(0.1, 0, -1));
  s.exploration.press_force_N = 3.5;
  s.exploration.stroke_speed_m_per_s = 0.08;
  s.tolerance_m = 0.004;
  s.workspace_scale = 1.5;
  s.force_scale = 0.5;
  s.has_clutch = false;
  return s;
}

/// Every vertex of `a` has one of `b` within distance, and the triangle counts agree.
void expect_same_surface(const geometry::TriangleMesh& a, const geometry::TriangleMesh& b) {
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  const double step = 0.17 / ((1 << kPositionBits) - 1);  // the largest box side here over the steps
  for (const glm::dvec3& p : a.positions_O) {
    double nearest = 1;
    for (const glm::dvec3& q : b.positions_O) nearest = std::min(nearest, glm::length(p - q));
    EXPECT_LT(nearest, step);
  }
  EXPECT_NEAR(geometry::signed_volume_m3(a), geometry::signed_volume_m3(b), 1e-3 * geometry::signed_volume_m3(a));
  EXPECT_TRUE(geometry::is_closed_and_oriented(b));
}

TEST(SceneDescription, ComesBack) {
  const SceneDescription s = scene();
  const auto blob = write_scene(s);
  ASSERT_TRUE(blob) << blob.error().message;
  const auto back = read_scene(*blob);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->name, s.name);
  EXPECT_EQ(back->tolerance_m, s.tolerance_m);
  EXPECT_EQ(back->workspace_scale, s.workspace_scale);
  EXPECT_EQ(back->force_scale, s.force_scale);
  EXPECT_EQ(back->has_clutch, s.has_clutch);
  EXPECT_EQ(back->tool.name, s.tool.name);
  EXPECT_EQ(back->tool.mass_kg, s.tool.mass_kg);
  EXPECT_EQ(back->tool.inertia_To_T_kg_m2, s.tool.inertia_To_T_kg_m2);
  EXPECT_EQ(back->tool.material.static_friction, s.tool.material.static_friction);
  expect_same_surface(s.tool.visible_T, back->tool.visible_T);
  EXPECT_EQ(back->exploration.p_TWork_T, s.exploration.p_TWork_T);
  EXPECT_EQ(back->exploration.nhat_work_T, s.exploration.nhat_work_T);
  EXPECT_EQ(back->exploration.region_low_W, s.exploration.region_low_W);
  EXPECT_EQ(back->exploration.region_high_W, s.exploration.region_high_W);
  EXPECT_EQ(back->exploration.approach_W, s.exploration.approach_W);
  EXPECT_EQ(back->exploration.press_force_N, s.exploration.press_force_N);
  EXPECT_EQ(back->exploration.stroke_speed_m_per_s, s.exploration.stroke_speed_m_per_s);
  ASSERT_EQ(back->objects.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(back->objects[i].name, s.objects[i].name);
    EXPECT_EQ(back->objects[i].X_WO, s.objects[i].X_WO);
    ASSERT_EQ(back->objects[i].motion.has_value(), s.objects[i].motion.has_value());
    if (s.objects[i].motion) {
      EXPECT_EQ(back->objects[i].motion->afterwards(), s.objects[i].motion->afterwards());
      for (const double s_s : {0.3, 1.7, 4.4})
        EXPECT_EQ(back->objects[i].motion->at(s_s).X_WO, s.objects[i].motion->at(s_s).X_WO);
    }
    expect_same_surface(s.objects[i].visible_O, back->objects[i].visible_O);
  }
}

/// By where a vertex is, so that Draco may name vertices as it likes.
Colour colour_at(const glm::dvec3& p) {
  return {static_cast<std::uint8_t>(p.x > 0 ? 250 : 20), static_cast<std::uint8_t>(p.y > 0 ? 90 : 0), 200};
}

TEST(SceneDescription, OfAScanKeepsItsColours) {
  SceneDescription s = scene();
  const std::size_t plain_bytes = write_scene(s).value().size();
  geometry::TriangleMesh& scan = s.objects[0].visible_O;
  for (glm::dvec3& p : scan.positions_O) p += glm::dvec3(1e-4);  // none on the border between two colours
  for (const glm::dvec3& p : scan.positions_O) s.objects[0].colours.push_back(colour_at(p));
  const auto blob = write_scene(s).value();
  EXPECT_GT(blob.size(), plain_bytes);
  const auto back = read_scene(blob);
  ASSERT_TRUE(back) << back.error().message;
  expect_same_surface(scan, back->objects[0].visible_O);
  ASSERT_EQ(back->objects[0].colours.size(), back->objects[0].visible_O.positions_O.size());
  for (std::size_t v = 0; v < back->objects[0].colours.size(); ++v)
    EXPECT_EQ(back->objects[0].colours[v], colour_at(back->objects[0].visible_O.positions_O[v])) << v;
  EXPECT_TRUE(back->objects[1].colours.empty());
  EXPECT_TRUE(back->tool.colours.empty());
}

// Who has never heard of colours reads every scene that has none.
TEST(SceneDescription, WithoutColoursSaysNothingOfThem) {
  SceneDescription s = scene();
  const auto version = [](const std::vector<std::byte>& blob) { return static_cast<int>(blob[4]); };
  EXPECT_EQ(version(write_scene(s).value()), 4);
  s.tool.colours.assign(s.tool.visible_T.positions_O.size(), {1, 2, 3});
  EXPECT_EQ(version(write_scene(s).value()), 5);
  s.tool.colours.pop_back();
  const auto fewer = write_scene(s);
  ASSERT_FALSE(fewer);
  EXPECT_NE(fewer.error().message.find("95 colours"), std::string::npos) << fewer.error().message;
}

TEST(SceneDescription, IsWrittenTheSameEveryTime) {
  EXPECT_EQ(write_scene(scene()).value(), write_scene(scene()).value());
}

TEST(SceneDescription, IsNotWrittenWithWhatTheReaderWouldRefuse) {
  const auto complaint = [](auto change) {
    SceneDescription s = scene();
    change(s);
    const auto blob = write_scene(s);
    return blob ? std::string("accepted") : blob.error().message;
  };
  EXPECT_NE(complaint([](auto& s) { s.name = std::string(129, 'x'); }).find("name"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.objects[0].name = "a\nb"; }).find("name"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.tolerance_m = kNan; }).find("tolerance"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.workspace_scale = 0; }).find("workspace"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.force_scale = kNan; }).find("force_scale"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.tool.mass_kg = 0; }).find("mass"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.tool.inertia_To_T_kg_m2[1][1] = -1; }).find("inertia"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.tool.inertia_To_T_kg_m2[0][1] = 2e-6; }).find("inertia"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.tool.material.stiffness_N_per_m = -1; }).find("material"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.exploration.nhat_work_T = {0, 0, 2}; }).find("direction"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.exploration.region_low_W.x = kNan; }).find("point"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.objects[1].X_WO.R *= 2.0; }).find("pose"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) {
              const std::vector<motion::Keyframe> keys{{0, {}}, {1, {{1, 0, 0, 0}, {1e5, 0, 0}}}};
              s.objects[0].motion.emplace(keys, motion::Afterwards::kStays);
            }).find("motion"),
            std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.objects[0].visible_O.positions_O[3].y = kNan; }).find("finite"),
            std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.objects[0].visible_O.triangles[3][1] = 1'000'000; }).find("out of range"),
            std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.tool.visible_T.triangles.clear(); }).find("no triangles"), std::string::npos);
  EXPECT_NE(complaint([](auto& s) { s.objects.resize(257, s.objects[0]); }).find("256"), std::string::npos);
}

// Each mesh within its bounds, but all of them together not: nothing is decoded.
TEST(SceneDescription, OfMoreTrianglesThanASceneMayHaveIsRefused) {
  auto blob = write_scene(scene()).value();
  const std::vector<geometry::TriangleMesh> meshes = [] {
    const SceneDescription s = scene();
    return std::vector{s.tool.visible_T, s.objects[0].visible_O, s.objects[1].visible_O};
  }();
  std::size_t at = 0;
  for (const geometry::TriangleMesh& mesh : meshes) {
    // The claim stands before the bitstream's length and its magic.
    constexpr std::string_view kMagic = "DRACO";
    const auto found = std::search(blob.begin() + static_cast<std::ptrdiff_t>(at), blob.end(), kMagic.begin(),
                                   kMagic.end(), [](std::byte b, char c) { return b == static_cast<std::byte>(c); });
    ASSERT_NE(found, blob.end());
    std::uint32_t claimed = 0;
    std::memcpy(&claimed, &*found - 8, sizeof claimed);
    ASSERT_EQ(claimed, mesh.triangles.size());
    claimed = kMaxMeshTriangles;
    std::memcpy(&*found - 8, &claimed, sizeof claimed);
    at = static_cast<std::size_t>(found - blob.begin()) + kMagic.size();
  }
  const auto read = read_scene(blob);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("4 million"), std::string::npos) << read.error().message;
}

TEST(SceneDescription, CutShortAnywhereIsRefused) {
  const auto blob = write_scene(scene()).value();
  for (std::size_t n = 0; n < blob.size(); n += n < 600 ? 1 : 97)
    EXPECT_FALSE(read_scene(std::span(blob).first(n))) << n;
  auto longer = blob;
  longer.push_back({});
  EXPECT_FALSE(read_scene(longer));
}

TEST(SceneDescription, WithChangedBytesIsRefusedOrStillSane) {
  const auto blob = write_scene(scene()).value();
  std::mt19937 random(4);
  int accepted = 0;
  for (int i = 0; i < 2000; ++i) {
    auto bent = blob;
    for (std::uint32_t n = 1 + random() % 4; n > 0; --n)
      bent[random() % bent.size()] = static_cast<std::byte>(random());
    const auto back = read_scene(bent);
    if (!back) continue;
    ++accepted;  // a transfer checks the hash first; here only memory and ranges are at stake
    for (const SceneObject& object : back->objects) {
      ASSERT_TRUE(spatial::is_valid(object.X_WO));
      for (const auto& triangle : object.visible_O.triangles) {
        for (const std::uint32_t index : triangle) ASSERT_LT(index, object.visible_O.positions_O.size());
      }
    }
  }
  EXPECT_LT(accepted, 2000);
}

TEST(DracoMesh, KeepsHardMeshesWithinHalfAStep) {
  // A box beside a needle, a fan around one vertex of high degree, and two separate pieces.
  geometry::TriangleMesh fan;
  fan.positions_O.emplace_back(0, 0, 0);
  for (int i = 0; i < 300; ++i)
    fan.positions_O.emplace_back(std::cos(i * 2 * M_PI / 300), 1e-3 * std::sin(i * 2 * M_PI / 300), 5);
  for (std::uint32_t i = 1; i <= 300; ++i) fan.triangles.push_back({0, i, i % 300 + 1});
  const auto bitstream = write_draco(fan);
  ASSERT_TRUE(bitstream);
  const auto back = read_draco(*bitstream, 300);
  ASSERT_TRUE(back) << back.error();
  EXPECT_LE(back->triangles.size(), 300u);
  EXPECT_GE(back->triangles.size(), 200u);  // slivers may collapse on the grid
  EXPECT_FALSE(read_draco(*bitstream, 299));
}

/// A grid with holes cut at random, in pieces: every kind of symbol and split that edgebreaker has.
geometry::TriangleMesh torn_sheet(unsigned seed) {
  std::mt19937 random(seed);
  constexpr std::uint32_t kSide = 30;
  geometry::TriangleMesh mesh;
  for (std::uint32_t i = 0; i < kSide; ++i) {
    for (std::uint32_t j = 0; j < kSide; ++j)
      mesh.positions_O.emplace_back(i * 1e-3, j * 1e-3, 1e-4 * static_cast<double>(random() % 10));
  }
  for (std::uint32_t i = 0; i + 1 < kSide; ++i) {
    for (std::uint32_t j = 0; j + 1 < kSide; ++j) {
      const std::uint32_t a = i * kSide + j, b = a + kSide;
      if (random() % 4 != 0) mesh.triangles.push_back({a, b, b + 1});
      if (random() % 4 != 0) mesh.triangles.push_back({a, b + 1, a + 1});
    }
  }
  return mesh;
}

TEST(DracoMesh, OfTornAndHandledSurfacesComesBack) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const auto mesh = torn_sheet(seed);
    const auto bitstream = write_draco(mesh);
    ASSERT_TRUE(bitstream);
    const auto back = read_draco(*bitstream, static_cast<std::uint32_t>(mesh.triangles.size()));
    ASSERT_TRUE(back) << back.error() << " seed " << seed;
    EXPECT_EQ(back->triangles.size(), mesh.triangles.size());
  }
}

TEST(DracoMesh, ThatClaimsMoreThanItsBytesCanHoldIsRefused) {
  const auto bitstream = write_draco(torus(8, 6)).value();
  ASSERT_TRUE(draco_bounds(bitstream));
  EXPECT_GE(draco_bounds(bitstream)->triangles, 96u);
  EXPECT_FALSE(read_draco(bitstream, 95));
  // "DRACO" major minor type method flags(2) traversal, then vertices and triangles as varints.
  auto huge = std::vector(bitstream.begin(), bitstream.begin() + 12);
  for (const int b : {0x80, 0x80, 0x80, 0x01, 0x80, 0x80, 0x80, 0x02}) huge.push_back(static_cast<std::byte>(b));
  huge.insert(huge.end(), bitstream.begin() + 14, bitstream.end());
  EXPECT_FALSE(draco_bounds(huge));
  EXPECT_FALSE(read_draco(huge, 2'000'000'000));
}

void expect_any_changed_byte_within_bounds(const std::vector<std::byte>& bitstream) {
  for (std::size_t at = 0; at < bitstream.size(); ++at) {
    for (int value = 0; value < 256; value += at < 60 ? 1 : 37) {
      auto bent = bitstream;
      bent[at] = static_cast<std::byte>(value);
      const auto bounds = draco_bounds(bent);
      if (!bounds) continue;
      EXPECT_LE(bounds->triangles, 16 * bent.size() + 1);
      EXPECT_LE(bounds->vertices, 64 * bent.size() + 4);
      const auto back = read_draco(bent, 1000);
      EXPECT_TRUE(!back || back->colours.empty() || back->colours.size() == back->positions_O.size());
    }
  }
}

TEST(DracoMesh, WithAnyByteChangedStaysWithinItsBounds) {
  expect_any_changed_byte_within_bounds(write_draco(torus(8, 6)).value());
}

TEST(DracoMesh, OfColoursWithAnyByteChangedStaysWithinItsBounds) {
  const geometry::TriangleMesh mesh = torus(8, 6);
  std::vector<Colour> colours;
  for (const glm::dvec3& p : mesh.positions_O) colours.push_back(colour_at(p));
  const auto bitstream = write_draco(mesh, kPositionBits, colours).value();
  ASSERT_TRUE(draco_bounds(bitstream));
  EXPECT_TRUE(draco_bounds(bitstream)->has_colours);
  expect_any_changed_byte_within_bounds(bitstream);
}

}  // namespace
}  // namespace farfeel::codecs
