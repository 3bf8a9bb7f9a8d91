// A leg of length L at speed v speeds up over r = reversal / 2, runs, and slows down over r, with speeds that are
// smooth (1 - cos) / 2 ramps. Its duration is L / v + r.
#include "tests/bench/strokes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfeel::bench {
namespace {

constexpr double kRamp_s = 0.5 * StrokePath::kReversal_s;

/// Way made t after the start of a ramp from rest to speed 1.
double ramp_way(double t_s) {
  const double x = t_s / kRamp_s;
  return 0.5 * kRamp_s * (x - std::sin(std::numbers::pi * x) / std::numbers::pi);
}

}  // namespace

std::vector<Stroke> strokes_of_every_speed() {
  return {{0.1, 0.030, 2}, {0.3, 0.036, 3}, {0.03, 0.009, 2}, {0.01, 0.003, 2}, {0.2, 0.030, 1}};
}

StrokePath::StrokePath(const std::vector<Stroke>& strokes, double start_m) : start_m_(start_m) {
  double t_s = 0, u_m = start_m, way = 1;
  for (const Stroke& stroke : strokes) {
    for (int i = 0; i < stroke.count; ++i) {
      const double duration_s = stroke.length_m / stroke.speed_m_s + kRamp_s;
      t_s += duration_s;
      legs_.push_back({t_s, duration_s, u_m, u_m + way * stroke.length_m, stroke.speed_m_s});
      u_m = legs_.back().to_m;
      way = -way;
    }
  }
}

double StrokePath::at_m(double t_s) const {
  if (t_s <= 0 || legs_.empty()) return start_m_;
  const auto leg = std::find_if(legs_.begin(), legs_.end(), [&](const Leg& l) { return t_s < l.end_s; });
  if (leg == legs_.end()) return legs_.back().to_m;
  const double in_s = t_s - (leg->end_s - leg->duration_s), left_s = leg->duration_s - in_s;
  const double length_m = std::abs(leg->to_m - leg->from_m);
  double way_m = 0;
  if (in_s < kRamp_s) {
    way_m = leg->speed_m_s * ramp_way(in_s);
  } else if (left_s < kRamp_s) {
    way_m = length_m - leg->speed_m_s * ramp_way(left_s);
  } else {
    way_m = leg->speed_m_s * (in_s - 0.5 * kRamp_s);
  }
  return leg->from_m + std::copysign(way_m, leg->to_m - leg->from_m);
}

}  // namespace farfeel::bench
