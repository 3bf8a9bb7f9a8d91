#include "tests/support/plate_patterns.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>

namespace farfeel::support {
namespace {

using std::numbers::pi;

constexpr double kTexel_m = 40e-6, kMargin_m = 0.4e-3;
/// Under a ball, and for a tool that lies flat on S.
constexpr PlateSize kPlate{.width_m = 0.04, .depth_m = 0.04, .texel_m = kTexel_m, .margin_m = kMargin_m};
constexpr PlateSize kFlatTool{.width_m = 8e-3, .depth_m = 6e-3, .texel_m = kTexel_m, .margin_m = kMargin_m};
constexpr PlateSize kUnderFlatTool{.width_m = 0.016, .depth_m = 0.016, .texel_m = kTexel_m, .margin_m = kMargin_m};
constexpr double kBall_m = 0.06, kSmallBall_m = 3e-3;
/// Two that lie in each other may not be turned; a flat tool may be tilted by what its roughness bears.
constexpr double kAnyTurn_rad = 3, kInEachOther_rad = 1e-3, kTilt_rad = 4e-3, kFlatTilt_rad = 0.3e-3;

/// 0 to 1 and back over a period of one.
double triangle_wave(double x) {
  return 1 - 2 * std::abs(x - std::floor(x) - 0.5);
}

HeightFunction saw(double period_m, double height_m) {
  return [=](double x, double) { return -height_m * triangle_wave(x / period_m); };
}

/// Pyramids between grooves that cross at right angles, at 45 degrees to the texels.
HeightFunction knurl(double period_m, double height_m) {
  return [=](double x, double y) {
    const double a = triangle_wave((x + y) * std::numbers::sqrt2 / 2 / period_m),
                 b = triangle_wave((x - y) * std::numbers::sqrt2 / 2 / period_m);
    return height_m * (std::min(a, b) - 1);
  };
}

HeightFunction chequer(double side_m, double height_m) {
  return [=](double x, double y) {
    const auto square = [side_m](double at) { return static_cast<std::int64_t>(std::floor(at / side_m)); };
    return (square(x) + square(y)) % 2 == 0 ? 0 : -height_m;
  };
}

/// One texel high, the next ones not: one in each square of that side, anywhere in it.
HeightFunction spikes(double side_m, double height_m, std::uint32_t seed) {
  return [=](double x, double y) {
    const auto column = [](double at) { return static_cast<std::int64_t>(std::floor(at / kTexel_m)); };
    const auto texels = static_cast<std::int64_t>(std::lround(side_m / kTexel_m));
    const std::int64_t far = texels * 4096, i = column(x) + far, j = column(y) + far;
    std::seed_seq place{static_cast<std::uint32_t>(i / texels), static_cast<std::uint32_t>(j / texels), seed};
    std::minstd_rand random(place);
    const bool is_here = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(texels)) == i % texels &&
                         static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(texels)) == j % texels;
    return is_here ? height_m * (0.8 + 0.2 * static_cast<double>(random() % 100) / 100) : 0;
  };
}

double plain(double, double) {
  return 0;
}

}  // namespace

HeightFunction ridges(double period_m, double depth_m, double turn_rad) {
  return [=](double x, double y) {
    const double along = std::cos(turn_rad) * x + std::sin(turn_rad) * y;
    return 0.5 * depth_m * (std::cos(2 * pi * along / period_m) - 1);
  };
}

HeightFunction roughness(double shortest_m, double longest_m, double rms_m, double growth, unsigned seed) {
  struct Wave {
    double x, y, phase, height;
  };
  constexpr int kWaves = 40;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> angle(0, 2 * pi);
  std::vector<Wave> waves;
  double square = 0;
  for (int i = 0; i < kWaves; ++i) {
    const double length_m = shortest_m * std::pow(longest_m / shortest_m, (i + 0.5) / kWaves);
    const double turn = angle(random), k = 2 * pi / length_m;
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

PlatePattern::PlatePattern(geometry::HapticSurface s, geometry::HapticSurface t, double most_turn_rad,
                           double most_tilt_rad)
    : s_surface_(std::move(s)),
      t_surface_(std::move(t)),
      s_(s_surface_),
      t_(t_surface_),
      most_turn_rad_(most_turn_rad),
      most_tilt_rad_(most_tilt_rad) {}

spatial::Pose PlatePattern::random_pose(std::mt19937& random) const {
  constexpr double kAside_m = 2e-3;
  std::uniform_real_distribution<double> unit(-1, 1);
  const double turn = most_turn_rad_ * unit(random), a = most_tilt_rad_ * unit(random),
               b = most_tilt_rad_ * unit(random);
  const glm::dquat turned_over{0, 1, 0, 0};  // half a turn about x
  const double x = kAside_m * unit(random), y = kAside_m * unit(random);
  return {glm::normalize(spatial::rotation_from_vector({a, b, 0}) * spatial::rotation_from_vector({0, 0, turn}) *
                         turned_over),
          {x, y, 0}};
}

penetration::Query PlatePattern::query(const spatial::Pose& X_CS, const spatial::Pose& X_ST, double soft_width_m,
                                       std::uint32_t samples) const {
  constexpr double kFar_m = 1;
  return {.s = {&s_, X_CS, triangles_},
          .t = {&t_, X_CS * X_ST, triangles_},
          .window = {{-kFar_m, -kFar_m}, {kFar_m, kFar_m}},
          .samples = samples,
          .soft_width_m = soft_width_m};
}

const std::vector<std::string>& plate_pattern_names() {
  static const std::vector<std::string> names{"saw",           "saw_in_saw",     "saw_in_saw_ball", "saw_small_ball",
                                              "knurl",         "knurl_on_knurl", "rough_flat",      "fine_grain",
                                              "spikes",        "spikes_both",    "fractal",         "parallel_ridges",
                                              "chequer_board", "ridged",         "rough",           "scan"};
  return names;
}

std::unique_ptr<PlatePattern> plate_pattern(std::string_view name) {
  const auto under_ball = [](const HeightFunction& s, const HeightFunction& t, double most_turn_rad,
                             double radius_m = kBall_m) {
    return std::make_unique<PlatePattern>(textured_plate(kPlate, s), textured_plate(kPlate, with_bulge(t, radius_m)),
                                          most_turn_rad, kTilt_rad);
  };
  const auto flat = [](const HeightFunction& s, const HeightFunction& t, double most_turn_rad) {
    return std::make_unique<PlatePattern>(textured_plate(kUnderFlatTool, s), textured_plate(kFlatTool, t),
                                          most_turn_rad, kFlatTilt_rad);
  };
  const HeightFunction teeth = saw(0.5e-3, 0.1e-3), diamonds = knurl(0.8e-3, 0.15e-3);
  if (name == "saw") return under_ball(teeth, plain, kAnyTurn_rad);
  if (name == "saw_in_saw") return flat(teeth, teeth, kInEachOther_rad);
  if (name == "saw_in_saw_ball") return under_ball(teeth, teeth, kInEachOther_rad);
  if (name == "saw_small_ball") return under_ball(teeth, plain, kAnyTurn_rad, kSmallBall_m);
  if (name == "knurl") return under_ball(diamonds, plain, kAnyTurn_rad);
  if (name == "knurl_on_knurl") return under_ball(diamonds, diamonds, kAnyTurn_rad);
  if (name == "rough_flat") {
    return flat(roughness(0.35e-3, 1.6e-3, 15e-6, 1, 1), roughness(0.35e-3, 1.6e-3, 15e-6, 1, 2), kAnyTurn_rad);
  }
  if (name == "fine_grain") return under_ball(roughness(0.12e-3, 0.2e-3, 6e-6, 1, 5), plain, kAnyTurn_rad);
  if (name == "spikes") return under_ball(spikes(0.8e-3, 115e-6, 1), plain, kAnyTurn_rad);
  if (name == "spikes_both") return under_ball(spikes(0.8e-3, 115e-6, 1), spikes(0.8e-3, 115e-6, 2), kAnyTurn_rad);
  if (name == "fractal") {
    return under_ball(roughness(0.15e-3, 6e-3, 30e-6, 0.6, 6), roughness(0.15e-3, 6e-3, 30e-6, 0.6, 7), kAnyTurn_rad);
  }
  if (name == "parallel_ridges") {
    const HeightFunction waves = ridges(0.5e-3, 0.1e-3, 0);
    return under_ball(waves, waves, kInEachOther_rad);
  }
  if (name == "chequer_board") return under_ball(chequer(0.5e-3, 60e-6), plain, kAnyTurn_rad);
  if (name == "ridged") return under_ball(ridges(3.7e-3, 0.3e-3, 0), ridges(4.2e-3, 0.3e-3, 0.9), kAnyTurn_rad);
  if (name == "rough") {
    return under_ball(roughness(0.35e-3, 1.6e-3, 15e-6, 1, 1), roughness(0.35e-3, 1.6e-3, 15e-6, 1, 2), kAnyTurn_rad);
  }
  if (name == "scan") return under_ball(roughness(0.2e-3, 8e-3, 60e-6, 1, 3), plain, kAnyTurn_rad, kSmallBall_m);
  throw std::invalid_argument(std::string(name) + ": no pattern has that name");
}

}  // namespace farfeel::support
