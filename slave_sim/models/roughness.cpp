#include "slave_sim/models/roughness.h"

#include <cmath>
#include <cstdint>
#include <numbers>

namespace farfeel::slave_sim {
namespace {

/// The n-th of a fixed sequence of well mixed numbers in [0, 1): splitmix64, Steele, Lea and Flood 2014.
double mixed(std::uint64_t n) {
  std::uint64_t z = (n + 1) * 0x9E37'79B9'7F4A'7C15;
  z = (z ^ z >> 30) * 0xBF58'476D'1CE4'E5B9;
  z = (z ^ z >> 27) * 0x94D0'49BB'1331'11EB;
  return static_cast<double>((z ^ z >> 31) >> 11) * 0x1p-53;
}

}  // namespace

SolidNoise::SolidNoise(const Roughness& rough) {
  constexpr std::size_t kWaves = 48;
  amplitude_m_ = rough.rms_m * std::sqrt(2.0 / kWaves);
  const double k_max = 2 * std::numbers::pi / rough.shortest_m, k_min = 2 * std::numbers::pi / rough.longest_m;
  const auto is_in_band = [&](double a, double b) { return std::hypot(a, b) >= k_min && std::hypot(a, b) <= k_max; };
  for (std::uint64_t n = 0; waves_.size() < kWaves; n += 4) {
    const glm::dvec3 k = k_max * (2.0 * glm::dvec3(mixed(n), mixed(n + 1), mixed(n + 2)) - 1.0);
    if (is_in_band(k.x, k.y) && is_in_band(k.y, k.z) && is_in_band(k.z, k.x)) {
      waves_.push_back({k, 2 * std::numbers::pi * mixed(n + 3)});
    }
  }
}

double SolidNoise::height_m(const glm::dvec3& p_m) const {
  double sum = 0;
  for (const Wave& wave : waves_) sum += std::sin(glm::dot(wave.k_1_per_m, p_m) + wave.phase);
  return amplitude_m_ * sum;
}

}  // namespace farfeel::slave_sim
