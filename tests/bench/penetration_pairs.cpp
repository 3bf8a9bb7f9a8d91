#include "tests/bench/penetration_pairs.h"

#include <stdexcept>

#include "tests/support/plate_patterns.h"

namespace farfeel::bench {
namespace {

using support::ridges;
using support::roughness;
using support::with_bulge;

constexpr double kBulgeRadius_m = 0.06, kProbeRadius_m = 3e-3;
constexpr support::PlateSize kPlate{
    .width_m = kPlateWidth_m, .depth_m = kPlateWidth_m, .texel_m = kPlateWidth_m / 1024, .margin_m = 0.4e-3};

}  // namespace

PlatePair::PlatePair(std::string name, HeightFunction s, HeightFunction t)
    : name_(std::move(name)),
      s_height_(std::move(s)),
      t_height_(std::move(t)),
      s_surface_(support::textured_plate(kPlate, s_height_)),
      t_surface_(support::textured_plate(kPlate, t_height_)),
      s_(s_surface_),
      t_(t_surface_) {}

spatial::Pose PlatePair::tool_pose(double turn_rad, const glm::dvec2& tilt_rad, const glm::dvec3& p_CT) {
  const glm::dquat turned_over{0, 1, 0, 0};  // half a turn about x
  return {glm::normalize(spatial::rotation_from_vector({tilt_rad.x, tilt_rad.y, 0}) *
                         spatial::rotation_from_vector({0, 0, turn_rad}) * turned_over),
          p_CT};
}

penetration::Query PlatePair::query(const spatial::Pose& X_CT, double soft_width_m, std::uint32_t samples) const {
  return {.s = {&s_, {}, triangles_},
          .t = {&t_, X_CT, triangles_},
          .window = kPlateWindow,
          .samples = samples,
          .soft_width_m = soft_width_m};
}

std::unique_ptr<PlatePair> plate_pair(const std::string& name) {
  const auto pair = [&](const HeightFunction& s, const HeightFunction& t, double radius_m) {
    return std::make_unique<PlatePair>(name, s, with_bulge(t, radius_m));
  };
  if (name == "ridged") return pair(ridges(3.7e-3, 0.3e-3, 0), ridges(4.2e-3, 0.3e-3, 0.9), kBulgeRadius_m);
  if (name == "rough") {
    return pair(roughness(0.35e-3, 1.6e-3, 15e-6, 1, 1), roughness(0.35e-3, 1.6e-3, 15e-6, 1, 2), kBulgeRadius_m);
  }
  if (name == "scan") {
    return pair(
        roughness(0.2e-3, 8e-3, 60e-6, 1, 3), [](double, double) { return 0.0; }, kProbeRadius_m);
  }
  throw std::invalid_argument(name + ": no pair of plates has that name");
}

}  // namespace farfeel::bench
