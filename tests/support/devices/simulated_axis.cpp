#include "tests/support/devices/simulated_axis.h"

#include <algorithm>
#include <cmath>

namespace farfeel::test_support {
namespace {

constexpr double kTick_s = 1e-3;
constexpr int kSubsteps = 50;

}  // namespace

double SimulatedAxis::encoded_m() const {
  return figures_.step_m > 0 ? std::floor(position_m_ / figures_.step_m) * figures_.step_m : position_m_;
}

void SimulatedAxis::push(double force_N) {
  commanded_N_[tick_ % kTicks] = force_N;
  const double acting_N = commanded_N_[(tick_ + kTicks - static_cast<std::size_t>(figures_.actuator_ticks)) % kTicks];
  const double b = figures_.viscous_Ns_per_m + figures_.hand_Ns_per_m, h = kTick_s / kSubsteps;
  const double begun_J = given_J_;
  for (int i = 0; i < kSubsteps; ++i) {
    // Viscous friction implicitly, so that it never gives; then dry friction, which stops at most.
    double v = (velocity_m_s_ + h * (acting_N + figures_.hand_N) / figures_.mass_kg) / (1 + h * b / figures_.mass_kg);
    const double dry_m_s = h * figures_.coulomb_N / figures_.mass_kg;
    v = std::abs(v) <= dry_m_s ? 0 : v - std::copysign(dry_m_s, v);
    const double moved_m = h * (v + velocity_m_s_) / 2;
    velocity_m_s_ = v;
    position_m_ += moved_m;
    given_J_ += acting_N * moved_m;
  }
  most_given_J_ = std::max(most_given_J_, given_J_);
  most_in_a_tick_J_ = std::max(most_in_a_tick_J_, given_J_ - begun_J);
  ++tick_;
  seen_m_[tick_ % kTicks] = encoded_m();
  told_m_ = seen_m_[(tick_ + kTicks - static_cast<std::size_t>(figures_.sensor_ticks)) % kTicks];
  const double smoothing = 1 - std::exp(-2 * M_PI * figures_.filter_Hz * kTick_s);
  told_m_s_ += smoothing * ((told_m_ - before_m_) / kTick_s - told_m_s_);
  before_m_ = told_m_;
}

double stiffest_calm_N_per_m(SimulatedAxis::Figures figures, double damping_Ns_per_m) {
  figures.coulomb_N = figures.step_m = figures.hand_N = 0;
  const auto is_calm = [&](double stiffness_N_per_m) {
    SimulatedAxis axis(figures, 1e-3);
    double early_m = 0, late_m = 0;
    constexpr int kTicks = 4000, kPart = 500;
    for (int i = 0; i < kTicks; ++i) {
      axis.push(-stiffness_N_per_m * axis.told_m() - damping_Ns_per_m * axis.told_m_s());
      if (i < kPart) early_m = std::max(early_m, std::abs(axis.position_m()));
      if (i >= kTicks - kPart) late_m = std::max(late_m, std::abs(axis.position_m()));
      if (!(std::abs(axis.position_m()) < 1)) return false;
    }
    return late_m < early_m;
  };
  double calm = 1, wild = 1e6;
  while (wild / calm > 1.002) {
    const double middle = std::sqrt(calm * wild);
    (is_calm(middle) ? calm : wild) = middle;
  }
  return calm;
}

}  // namespace farfeel::test_support
