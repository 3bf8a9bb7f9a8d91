#include "master_station/devices/host/swing_fit.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace farfeel::devices {
namespace {

constexpr double kTie = 1e-9;  // against sums that are 1 a swing
/// Of an even spread over a step: several samples tell each stop. By trying on simulated devices.
constexpr double kOfAStep = 0.5;

}  // namespace

TurningPoints::TurningPoints(double step_m) : noise_m_(std::max(kNoiseSteps * step_m, kLeastNoise_m)) {
  positions_m_.reserve(kSamplesMax);
  at_.reserve(kSamplesMax);
}

void TurningPoints::clear() {
  positions_m_.clear();
  at_.clear();
  extreme_ = 0;
  direction_ = 0;
}

bool TurningPoints::add(double position_m) {
  if (positions_m_.size() == kSamplesMax) return false;
  positions_m_.push_back(position_m);
  const double from_extreme_m = position_m - positions_m_[extreme_];
  if (direction_ == 0) {
    if (std::abs(from_extreme_m) < noise_m_) return false;
    direction_ = from_extreme_m > 0 ? 1 : -1;
    extreme_ = positions_m_.size() - 1;
    return false;
  }
  if (from_extreme_m * direction_ >= 0) {
    extreme_ = positions_m_.size() - 1;
    return false;
  }
  if (std::abs(from_extreme_m) < noise_m_) return false;
  at_.push_back(extreme_);
  direction_ = -direction_;
  extreme_ = positions_m_.size() - 1;
  return true;
}

/// The top of the parabola that fits the samples about a turning point best: of a sixteenth of a period on each side,
/// where a sine is nearly one, and where dry friction, which bends the two sides differently, moves it little.
double TurningPoints::refined_m(std::size_t which) const {
  const std::size_t i = at_[which];
  const std::size_t half_period = which > 0 ? i - at_[which - 1] : at_.size() > 1 ? at_[1] - i : 0;
  const std::size_t w = std::min({std::max<std::size_t>(half_period / 8, 1), i, positions_m_.size() - 1 - i});
  if (w == 0) return positions_m_[i];
  // Least squares of a + b k + c k^2 for k = -w .. w: odd sums vanish.
  double n = 0, k2 = 0, k4 = 0, y = 0, yk = 0, yk2 = 0;
  for (int k = -static_cast<int>(w); k <= static_cast<int>(w); ++k) {
    const double q = static_cast<double>(k) * k;
    const double value = positions_m_[static_cast<std::size_t>(static_cast<int>(i) + k)];
    n += 1;
    k2 += q;
    k4 += q * q;
    y += value;
    yk += value * k;
    yk2 += value * q;
  }
  const double c = (n * yk2 - k2 * y) / (n * k4 - k2 * k2), b = yk / k2, a = (y - c * k2) / n;
  if (c == 0 || std::abs(b / (2 * c)) > static_cast<double>(w)) return positions_m_[i];
  return a - b * b / (4 * c);
}

bool TurningPoints::rests(std::size_t samples) const {
  if (positions_m_.size() < samples) return false;
  const auto [least, most] = std::ranges::minmax(std::span(positions_m_).last(samples));
  return most - least < noise_m_;
}

std::vector<double> TurningPoints::stops_m(std::size_t from, bool rests) const {
  std::vector<double> stops;
  for (std::size_t i = 0; i < at_.size(); ++i)
    if (at_[i] >= from) stops.push_back(refined_m(i));
  if (rests && positions_m_.size() > from) stops.push_back(positions_m_.back());
  return stops;
}

void SwingFit::add(std::span<const double> stops_m, double least_m) {
  for (std::size_t i = 0; i + 1 < stops_m.size(); ++i) {
    if (std::abs(stops_m[i + 1] - stops_m[i]) < least_m) return;
    const double side = stops_m[i] > stops_m[i + 1] ? 1 : -1;
    const glm::dvec3 x(side * stops_m[i], 1, side);
    const double y = -side * stops_m[i + 1];
    ++n_;
    xx_ += glm::outerProduct(x, x);
    xy_ += x * y;
    yy_ += y * y;
  }
}

SwingFit::Result SwingFit::result() const {
  const auto n = static_cast<double>(n_);
  glm::dmat3 xx = xx_;
  glm::dvec3 xy = xy_;
  // Each place is wrong by a part of an encoder's step. What A has of its own stop makes a line look flatter; the
  // middle's error is in A and A', with opposite signs. The means of both are known, and taken out.
  const double spread_m2 = kOfAStep * step_m_ * step_m_ / 12;
  xx[0][0] -= 2 * n * spread_m2;
  xy[0] += n * spread_m2;
  // When all swings begin at one side, d and g cannot be told apart, and need not: the smallest pair is taken.
  for (int i = 1; i < 3; ++i) xx[i][i] += kTie * n;
  double unknowns = 3;
  glm::dvec3 fit = glm::inverse(xx) * xy;
  if (fit.y > 0) {  // friction gives nothing: left out of the fit
    for (int i = 0; i < 3; ++i) xx[1][i] = xx[i][1] = i == 1 ? 1 : 0;
    xy.y = 0;
    unknowns = 2;
    fit = glm::inverse(xx) * xy;
  }
  const double left_m2 = std::max(yy_ - 2 * glm::dot(fit, xy_) + glm::dot(fit, xx_ * fit), 0.0);
  return {fit.x, -fit.y, std::sqrt(left_m2 / (n - unknowns) * glm::inverse(xx)[0][0])};
}

}  // namespace farfeel::devices
