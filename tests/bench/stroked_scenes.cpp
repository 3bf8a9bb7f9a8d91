#include "tests/bench/stroked_scenes.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "slave_sim/bake/bake.h"
#include "slave_sim/models/height_plate.h"
#include "slave_sim/models/lattice_solid.h"
#include "slave_sim/models/models.h"
#include "slave_sim/models/roughness.h"

namespace farfeel::bench {
namespace {

constexpr double kDomeRadius_m = 0.080, kProbeRadius_m = 3e-3;
constexpr slave_sim::PlateSize kTable{.size_m = {0.060, 0.030, 0.004}};
const glm::dquat kTurnedOver{0, 1, 0, 0};  // half a turn about x

geometry::HapticSurface curved_plate() {
  return slave_sim::ridged_plate(0.012, 0.3e-3, {.size_m = {0.006, 0.005, 0.004}});
}

geometry::HapticSurface rough_table() {
  return slave_sim::height_plate(
      [](double x, double y) {
        double z = 0;
        for (int k = 0; k < 12; ++k) {
          const double wave = 2 * std::numbers::pi / (1.2e-3 * std::pow(1.115, k)), angle = 2.4 * k;
          z += 16e-6 * std::cos(wave * (std::cos(angle) * x + std::sin(angle) * y) + 1.7 * k);
        }
        return z;
      },
      kTable);
}

/// What a scanner might give of a vaulted relief, 64 x 28 x 10 mm, its crest along y at z = 0.
geometry::TriangleMesh dome_mesh() {
  const slave_sim::SolidNoise relief({60e-6, 1e-3, 8e-3});
  constexpr double kHalfLength_m = 0.032, kHalfWidth_m = 0.014, kThick_m = 0.010;
  const slave_sim::LatticeSolid solid{
      {{{-kHalfLength_m, kHalfLength_m}, {-kHalfWidth_m, kHalfWidth_m}, {-kThick_m, 0}}},
      {{{256}, {112}, {4}}},
      [](int, int, int) { return true; }};
  return slave_sim::skin(solid, [&](const slave_sim::LatticePoint& point) {
    const double angle = point.p.x / kDomeRadius_m;
    const glm::dvec3 out{std::sin(angle), 0, std::cos(angle)};
    const bool is_on_top_alone =
        point.is_on(2, 1) && !point.is_on(0, 0) && !point.is_on(0, 1) && !point.is_on(1, 0) && !point.is_on(1, 1);
    const double height_m = is_on_top_alone ? relief.height_m(point.p) : 0;
    return glm::dvec3{0, point.p.y, -kDomeRadius_m} + (kDomeRadius_m + point.p.z + height_m) * out;
  });
}

std::unique_ptr<StrokedScene> scanned_dome() {
  const slave_sim::Model& probe = *slave_sim::find_model("probe");
  slave_sim::BakeOptions smooth{.coarse_triangles = probe.coarse_triangles, .texture = 256};
  smooth.coarse = probe.base_mesh();
  auto dome = slave_sim::bake_asset("dome", dome_mesh(), {.coarse_triangles = 400, .texture = 700});
  auto ball = slave_sim::bake_asset("probe", probe.full_mesh(), smooth);
  if (!dome) throw std::runtime_error(dome.error().message);
  if (!ball) throw std::runtime_error(ball.error().message);
  const spatial::Pose X_WO{{1, 0, 0, 0}, -dome->asset.p_OM_O};
  return std::make_unique<StrokedScene>("scan", std::move(dome->asset.felt), std::move(ball->asset.felt),
                                        glm::dquat{1, 0, 0, 0}, kProbeRadius_m, kDomeRadius_m, X_WO);
}

}  // namespace

StrokedScene::StrokedScene(std::string name, geometry::HapticSurface object, geometry::HapticSurface tool,
                           const glm::dquat& R_WT, double tool_radius_m, double object_radius_m,
                           const spatial::Pose& X_WO)
    : FeltPair(std::move(name), std::move(object), std::move(tool), 0.005, X_WO),
      R_WT_(R_WT),
      tool_radius_m_(tool_radius_m),
      object_radius_m_(object_radius_m) {}

glm::dvec3 StrokedScene::nhat_W(double along_m) const {
  const double angle = object_radius_m_ > 0 ? along_m / object_radius_m_ : 0;
  return {std::sin(angle), 0, std::cos(angle)};
}

spatial::Pose StrokedScene::X_WT(double along_m, double across_m, double turn_rad, double press_m) const {
  const glm::dvec3 n = nhat_W(along_m);
  const glm::dvec3 p = object_radius_m_ > 0 ? glm::dvec3{0, across_m, -object_radius_m_} + object_radius_m_ * n
                                            : glm::dvec3{along_m, across_m, 0};
  return {glm::normalize(spatial::rotation_from_vector(turn_rad * n) * R_WT_), p + (tool_radius_m_ - press_m) * n};
}

std::vector<std::unique_ptr<StrokedScene>> stroked_scenes(SceneChoice choice) {
  std::vector<std::unique_ptr<StrokedScene>> scenes;
  if (choice == SceneChoice::kAll)
    scenes.push_back(std::make_unique<StrokedScene>("ridges", slave_sim::ridged_plate(1.5e-3, 0.1e-3, kTable),
                                                    curved_plate(), kTurnedOver, 0));
  scenes.push_back(std::make_unique<StrokedScene>("roughness", rough_table(), curved_plate(), kTurnedOver, 0));
  if (choice == SceneChoice::kAll) scenes.push_back(scanned_dome());
  return scenes;
}

}  // namespace farfeel::bench
