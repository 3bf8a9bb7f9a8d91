#include "slave_sim/models/models.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfeel::slave_sim {
namespace {

TEST(ModelsTest, EveryModelIsClosedOrientedAndOfTheTablesSize) {
  for (const Model& model : models()) {
    SCOPED_TRACE(model.name);
    const geometry::TriangleMesh mesh = model.full_mesh();
    EXPECT_EQ(mesh.triangles.size(), model.full_triangles);
    EXPECT_TRUE(geometry::is_closed_and_oriented(mesh));
    EXPECT_GT(geometry::signed_volume_m3(mesh), 0);
    const auto has_no_area = [&](const geometry::Triangle& t) {
      return geometry::unit_normal(mesh, t) == glm::dvec3(0);
    };
    EXPECT_EQ(std::count_if(mesh.triangles.begin(), mesh.triangles.end(), has_no_area), 0);
    if (model.base_mesh != nullptr) {
      const geometry::TriangleMesh base = model.base_mesh();
      EXPECT_EQ(base.triangles.size(), model.coarse_triangles);
      EXPECT_TRUE(geometry::is_closed_and_oriented(base));
      EXPECT_NEAR(geometry::signed_volume_m3(base), geometry::signed_volume_m3(mesh),
                  0.01 * geometry::signed_volume_m3(mesh));
    }
  }
}

void expect_size(const geometry::TriangleMesh& mesh, const glm::dvec3& size_m, double tolerance_m) {
  const glm::dvec3 size = geometry::bounding_box(mesh).size();
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(size[axis], size_m[axis], tolerance_m) << "axis " << axis;
}

TEST(ModelsTest, SizesAreTheTables) {
  expect_size(block_mesh(), {.080, .080, .040}, 1e-5);
  expect_size(gear_mesh(), {.120, .120, .030}, 1e-5);
  expect_size(file_mesh(), {.200, .025, .006}, 1e-4);
  expect_size(cad_part_mesh(), {.160, .120, .060}, 2e-3);
  expect_size(hammer_mesh(), {.300, .110, .033}, 3e-3);
  expect_size(probe_mesh(), {.006, .006, .006}, 1e-5);
  expect_size(helicoidal_torus_mesh(), {.160, .160, .040}, 2e-3);
}

/// Amplitude of cos and sin of one spatial frequency in samples (position, height), by projection.
double amplitude_at(const std::vector<glm::dvec2>& samples, double period_m) {
  glm::dvec2 sum(0);
  for (const glm::dvec2& s : samples) {
    const double angle = 2 * std::numbers::pi * s.x / period_m;
    sum += s.y * glm::dvec2(std::cos(angle), std::sin(angle));
  }
  return 2 * glm::length(sum) / static_cast<double>(samples.size());
}

double mean_removed(std::vector<glm::dvec2>& samples) {
  double mean = 0;
  for (const glm::dvec2& s : samples) mean += s.y / static_cast<double>(samples.size());
  for (glm::dvec2& s : samples) s.y -= mean;
  return mean;
}

TEST(ModelsTest, BlockHasRidgesOfSixMillimetresAndOneAndAHalfDeep) {
  std::vector<glm::dvec2> profile;
  double low = 1, high = -1;
  for (const glm::dvec3& p : block_mesh().positions_O) {
    if (p.z < 0.018 || std::abs(p.x) > 0.036 || std::abs(p.y) > 0.0399)
      continue;  // twelve whole periods of the upper face
    profile.emplace_back(p.x, p.z);
    low = std::min(low, p.z), high = std::max(high, p.z);
  }
  mean_removed(profile);
  EXPECT_NEAR(high - low, 0.0015, 2e-5);
  EXPECT_NEAR(amplitude_at(profile, 0.006), 0.00075, 2e-5);
  EXPECT_LT(amplitude_at(profile, 0.003), 2e-5);
}

TEST(ModelsTest, GearHasSixtyRidgesRoundItsRim) {
  std::vector<glm::dvec2> profile;  // angle as a length, radius
  for (const glm::dvec3& p : gear_mesh().positions_O) {
    const double radius = std::hypot(p.x, p.y);
    if (radius > 0.055) profile.emplace_back(std::atan2(p.y, p.x), radius);
  }
  EXPECT_NEAR(mean_removed(profile), 0.060 - 0.00075, 1e-6);
  EXPECT_NEAR(amplitude_at(profile, 2 * std::numbers::pi / 60), 0.00075, 1e-6);
}

TEST(ModelsTest, FileHasCrossedRidgesOfOneAndAHalfMillimetres) {
  // The blade's own shape is even in y and smooth; what changes sign quickly along both diagonals is the cut.
  std::vector<glm::dvec2> u, v;
  for (const glm::dvec3& p : file_mesh().positions_O) {
    if (p.z < 0.0015 || std::abs(p.y) > 0.006 || std::abs(p.x) > 0.05) continue;
    const double s = p.x + 0.1, thickness = 0.0027 * (1 - 0.1 * s * s / 0.01);
    u.emplace_back((p.x + p.y) / std::numbers::sqrt2, p.z - thickness);
    v.emplace_back((p.x - p.y) / std::numbers::sqrt2, p.z - thickness);
  }
  mean_removed(u), mean_removed(v);
  EXPECT_NEAR(amplitude_at(u, 0.0015), 0.000075, 1e-5);  // each of two families carries half the depth, peak to peak
  EXPECT_NEAR(amplitude_at(v, 0.0015), 0.000075, 1e-5);
}

TEST(ModelsTest, TorusHasWrinklesThatWindThreeTimes) {
  std::vector<glm::dvec2> profile;  // angle across the wrinkles, radius of the tube
  for (const glm::dvec3& p : helicoidal_torus_mesh().positions_O) {
    const double ring = std::hypot(p.x, p.y) - 0.060;
    profile.emplace_back(std::atan2(p.z, ring) - 3 * std::atan2(p.y, p.x), std::hypot(ring, p.z));
  }
  EXPECT_NEAR(mean_removed(profile), 0.020, 1e-6);
  EXPECT_NEAR(amplitude_at(profile, 2 * std::numbers::pi / 18), 0.0006, 1e-6);
}

TEST(ModelsTest, HammerHasBumpsOnItsStrikingFace) {
  std::vector<glm::dvec2> face;
  for (const glm::dvec3& p : hammer_mesh().positions_O) {
    if (p.y > 0.0535 && std::hypot(p.x + 0.134, p.z) < 0.014) face.emplace_back(0, p.y);
  }
  ASSERT_GT(face.size(), 1000U);
  EXPECT_NEAR(mean_removed(face), 0.055, 5e-5);
  double square = 0;
  for (const glm::dvec2& f : face) square += f.y * f.y / static_cast<double>(face.size());
  EXPECT_NEAR(std::sqrt(square), 0.00015, 0.00003);
}

TEST(ModelsTest, ProbeIsASphere) {
  const geometry::TriangleMesh mesh = probe_mesh();
  for (const glm::dvec3& p : mesh.positions_O) EXPECT_NEAR(glm::length(p), 0.003, 1e-12);
  for (const geometry::Triangle& t : mesh.triangles) {  // no facet sinks by more than a micrometre
    const glm::dvec3 middle = (mesh.positions_O[t[0]] + mesh.positions_O[t[1]] + mesh.positions_O[t[2]]) / 3.0;
    EXPECT_GT(glm::length(middle), 0.003 - 1e-6);
  }
}

TEST(ModelsTest, CadPartIsRoughAsTabled) {
  std::vector<double> height;
  for (const glm::dvec3& p : cad_part_mesh().positions_O) {
    if (p.z < -0.028 && std::abs(p.x) < 0.02 && std::abs(p.y) < 0.04) height.push_back(p.z + 0.030);
  }
  double square = 0;
  for (const double h : height) square += h * h / static_cast<double>(height.size());
  EXPECT_NEAR(std::sqrt(square), 0.00015, 0.00002);
}

}  // namespace
}  // namespace farfeel::slave_sim
