#include "tests/bench/penetration_pairs.h"

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "tests/support/plates.h"

namespace farfeel::bench {
namespace {

constexpr double kBulgeRadius_m = 0.06, kProbeRadius_m = 3e-3;
constexpr support::PlateSize kPlate{
    .width_m = kPlateWidth_m, .depth_m = kPlateWidth_m, .texel_m = kPlateWidth_m / 1024, .margin_m = 0.4e-3};

HeightFunction ridges(double period_m, double depth_m, double turn_rad) {
  return [=](double x, double y) {
    const double along = std::cos(turn_rad) * x + std::sin(turn_rad) * y;
    return 0.5 * depth_m * (std::cos(2 * std::numbers::pi * along / period_m) - 1);
  };
}

/// A sum of waves of random direction and phase, wavelengths spread evenly on a logarithmic scale.
HeightFunction roughness(double shortest_m, double longest_m, double rms_m, double growth, unsigned seed) {
  struct Wave {
    double x, y, phase, height;
  };
  constexpr int kWaves = 40;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> angle(0, 2 * std::numbers::pi);
  std::vector<Wave> waves;
  double square = 0;
  for (int i = 0; i < kWaves; ++i) {
    const double length_m = shortest_m * std::pow(longest_m / shortest_m, (i + 0.5) / kWaves);
    const double turn = angle(random), k = 2 * std::numbers::pi / length_m;
    waves.push_back({k * std::cos(turn), k * std::sin(turn), angle(random), std::pow(length_m, growth)});
    square += 0.5 * waves.back().height * waves.back().height;
  }
  for (Wave& wave : waves) wave.height *= rms_m / std::sqrt(square);
  return [waves](double x, double y) {
    double height = 0;
    for (const Wave& wave : waves) height += wave.height * std::cos(wave.x * x + wave.y * y + wave.phase);
    return height;
  };
}

HeightFunction with_bulge(const HeightFunction& height, double radius_m) {
  return [=](double x, double y) { return height(x, y) - (x * x + y * y) / (2 * radius_m); };
}

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
