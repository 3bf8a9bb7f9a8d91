// Third octaves of a force: what a finger makes of a texture.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <span>

namespace farfeel::bench {

/// Band b is centred on 10^((13 + b) / 10) Hz: 20, 25, 31.5 ... 1000.
inline constexpr int kThirdOctaves = 18;
[[nodiscard]] double third_octave_Hz(int band);

/// Mean square in each band, all three directions together [N^2]; 0 above what the rate holds.
using OctavePowers = std::array<double, kThirdOctaves>;
/// Of at least half a second.
[[nodiscard]] OctavePowers third_octaves(std::span<const glm::dvec3> force_N, double rate_Hz);

struct SpectrumError {
  double rms_dB = 0;    ///< over the bands
  double worst_dB = 0;  ///< signed: > 0 is too much
  double worst_Hz = 0;
};
/// Over bands up to limit_Hz. What is 30 dB below all of the truth's power is as good as nothing, there and here.
[[nodiscard]] SpectrumError spectrum_error(const OctavePowers&, const OctavePowers& truth, double limit_Hz);
[[nodiscard]] double power_from(const OctavePowers&, double low_Hz);  ///< [N^2]

}  // namespace farfeel::bench
