// Welch: windows of half a second, Hann, half overlapped, each without its mean. A bin's share of the mean square is
// 2 |X|^2 / (N sum w^2), and every bin belongs to the band whose edges, 10^(1/20) about its centre, hold it.
#include "tests/bench/octaves.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <vector>

namespace farfeel::bench {
namespace {

constexpr double kWindow_s = 0.5, kNothing = 1e-3;

int band_of(double Hz) {
  return static_cast<int>(std::lround(10 * std::log10(Hz))) - 13;
}

}  // namespace

double third_octave_Hz(int band) {
  return std::pow(10, 0.1 * (13 + band));
}

OctavePowers third_octaves(std::span<const glm::dvec3> force_N, double rate_Hz) {
  const auto window = static_cast<std::size_t>(std::lround(kWindow_s * rate_Hz));
  OctavePowers powers{};
  if (force_N.size() < window) return powers;
  std::vector<double> hann(window);
  for (std::size_t i = 0; i < window; ++i)
    hann[i] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(window));
  const double weight = std::inner_product(hann.begin(), hann.end(), hann.begin(), 0.0);
  int windows = 0;
  std::vector<glm::dvec3> part(window);
  for (std::size_t from = 0; from + window <= force_N.size(); from += window / 2, ++windows) {
    const auto all = force_N.subspan(from, window);
    const glm::dvec3 mean = std::accumulate(all.begin(), all.end(), glm::dvec3(0)) / static_cast<double>(window);
    for (std::size_t i = 0; i < window; ++i) part[i] = hann[i] * (all[i] - mean);
    const auto last = static_cast<std::size_t>(std::min(0.5 * rate_Hz, 1122.0) * kWindow_s);
    for (std::size_t bin = 1; bin < last; ++bin) {
      const int band = band_of(static_cast<double>(bin) / kWindow_s);
      if (band < 0 || band >= kThirdOctaves) continue;
      const double angle = -2 * std::numbers::pi * static_cast<double>(bin) / static_cast<double>(window);
      const std::complex<double> turn = std::polar(1.0, angle);
      std::complex<double> phase = 1, x = 0, y = 0, z = 0;
      for (const glm::dvec3& f : part) {
        x += f.x * phase, y += f.y * phase, z += f.z * phase;
        phase *= turn;
      }
      powers[static_cast<std::size_t>(band)] +=
          2 * (std::norm(x) + std::norm(y) + std::norm(z)) / (static_cast<double>(window) * weight);
    }
  }
  for (double& power : powers) power /= windows;
  return powers;
}

SpectrumError spectrum_error(const OctavePowers& powers, const OctavePowers& truth, double limit_Hz) {
  const double nothing = kNothing * std::accumulate(truth.begin(), truth.end(), 0.0);
  SpectrumError error;
  double squares = 0;
  int bands = 0;
  for (int b = 0; b < kThirdOctaves && third_octave_Hz(b) <= limit_Hz; ++b, ++bands) {
    const auto i = static_cast<std::size_t>(b);
    const double dB = 10 * std::log10(std::max(powers[i], nothing) / std::max(truth[i], nothing));
    squares += dB * dB;
    if (std::abs(dB) > std::abs(error.worst_dB)) error.worst_dB = dB, error.worst_Hz = third_octave_Hz(b);
  }
  error.rms_dB = std::sqrt(squares / std::max(1, bands));
  return error;
}

double power_from(const OctavePowers& powers, double low_Hz) {
  double sum = 0;
  for (int b = 0; b < kThirdOctaves; ++b)
    if (third_octave_Hz(b) >= low_Hz) sum += powers[static_cast<std::size_t>(b)];
  return sum;
}

}  // namespace farfeel::bench
