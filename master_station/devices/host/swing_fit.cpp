#include "master_station/devices/host/swing_fit.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace farfeel::devices {
namespace {

constexpr double kTie = 1e-9;       // against sums that are 1 a swing
constexpr double kOfSeveral = 0.5;  // of one sample's variance

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

SwingFit::Solved SwingFit::solved(const glm::dmat3& told_xx, const glm::dvec3& told_xy) const {
  const auto n = static_cast<double>(n_);
  glm::dmat3 xx = xx_ + told_xx;
  glm::dvec3 xy = xy_ + told_xy;
  // Each place is wrong by a part of an encoder's step, evenly spread; stops, which several samples tell, by less. What
  // A has of its own stop makes a line look flatter; the middle's error is in A and A', with opposite signs. The means
  // of both are known, and taken out.
  const double spread_m2 = step_m_ * step_m_ / 12;
  xx[0][0] -= (1 + kOfSeveral) * n * spread_m2;
  xy[0] += n * spread_m2;
  // When all swings begin at one side, d and g cannot be told apart, and need not: the smallest pair is taken.
  for (int i = 1; i < 3; ++i) xx[i][i] += kTie * n;
  double unknowns = 3;
  glm::dmat3 inverse = glm::inverse(xx);
  glm::dvec3 fit = inverse * xy;
  if (fit.y > 0) {  // friction gives nothing: left out of the fit
    for (int i = 0; i < 3; ++i) xx[1][i] = xx[i][1] = i == 1 ? 1 : 0;
    xy.y = 0;
    unknowns = 2;
    inverse = glm::inverse(xx);
    fit = inverse * xy;
  }
  const double left_m2 = std::max(yy_ - 2 * glm::dot(fit, xy_) + glm::dot(fit, xx_ * fit), 0.0);
  return {fit, inverse, std::max(left_m2 / (n - unknowns), spread_m2)};
}

SwingFit::Result SwingFit::result(const DryFriction& told) const {
  const Solved alone = solved(glm::dmat3(0), glm::dvec3(0));
  Result result;
  // f = d / (1 + r), and its error by the two that it is made of.
  const double ratio = alone.fit.x;
  result.friction.moves_m = -alone.fit.y / (1 + ratio);
  const glm::dvec3 slope(-result.friction.moves_m / (1 + ratio), -1 / (1 + ratio), 0);
  result.friction.error_m = std::sqrt(std::max(alone.variance_m2 * glm::dot(slope, alone.inverse * slope), 0.0));
  Solved both = alone;
  if (std::isfinite(told.error_m) && told.error_m > 0) {
    // What is known of f is one more measurement: -f = r f - d, with the error of about 2 f's.
    const glm::dvec3 x(told.moves_m, 1, 0);
    const double weight = alone.variance_m2 / (4 * told.error_m * told.error_m);
    both = solved(weight * glm::outerProduct(x, x), weight * -told.moves_m * x);
  }
  result.ratio = both.fit.x;
  result.ratio_error = std::sqrt(both.variance_m2 * both.inverse[0][0]);
  return result;
}

}  // namespace farfeel::devices
