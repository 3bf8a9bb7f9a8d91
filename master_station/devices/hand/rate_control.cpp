#include "master_station/devices/hand/rate_control.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/spatial/no_longer_than.h"

namespace farfeel::devices {
namespace {

/// A device that reports at 100 Hz or more is trusted in full between its reports.
constexpr std::int64_t kHalfStale_ns = kStaleSample_ns / 2;

glm::dvec3 shaped_vector(const glm::dvec3& deflection) {
  const double length = glm::length(deflection);
  return length > 0 ? shaped(length) / length * deflection : glm::dvec3(0);
}

}  // namespace

double shaped(double deflection) noexcept {
  const double x = (deflection - RateControl::kDeadBand) / (1 - RateControl::kDeadBand);
  return x > 0 ? std::min(x * x, 1.0) : 0;
}

double trusted_share(std::int64_t silence_ns) noexcept {
  if (silence_ns <= kHalfStale_ns) return 1;
  if (silence_ns >= kStaleSample_ns) return 0;
  return static_cast<double>(kStaleSample_ns - silence_ns) / static_cast<double>(kStaleSample_ns - kHalfStale_ns);
}

Deflection RateControl::chosen(const Deflection& all) noexcept {
  if (!spatial::is_finite(all.turn) || !spatial::is_finite(all.push)) return {};
  switch (settings_.axes) {
    case Axes::kAll:
      return all;
    case Axes::kTranslation:
      return {glm::dvec3(0), all.push};
    case Axes::kRotation:
      return {all.turn, glm::dvec3(0)};
    case Axes::kDominant:
      break;
  }
  const auto axis = [&](int i) { return i < 3 ? all.turn[i] : all.push[i - 3]; };
  for (int i = 0; i < 6; ++i) {
    if (std::abs(axis(i)) > kTakesOver * std::max(std::abs(axis(dominant_)), kDeadBand)) dominant_ = i;
  }
  Deflection one;
  (dominant_ < 3 ? one.turn[dominant_] : one.push[dominant_ - 3]) = axis(dominant_);
  return one;
}

spatial::Twist RateControl::advance(const Deflection& deflection, double trusted, double dt_s) noexcept {
  if (!(trusted > 0)) {
    share_ = {};
    return {};
  }
  const Deflection wanted = chosen(deflection);
  const double most = dt_s / kRise_s;
  share_.turn += spatial::no_longer_than(most, shaped_vector(wanted.turn) - share_.turn);
  share_.push += spatial::no_longer_than(most, shaped_vector(wanted.push) - share_.push);
  return {trusted * settings_.full_rotation_rad_s * share_.turn, trusted * settings_.full_speed_m_s * share_.push};
}

}  // namespace farfeel::devices
