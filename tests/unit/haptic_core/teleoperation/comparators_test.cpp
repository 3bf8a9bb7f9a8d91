// The textbook methods that ours is measured against keep their own promises.
#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "haptic_core/teleoperation/time_domain_passivity.h"
#include "haptic_core/teleoperation/wave_variables.h"

namespace farfeel::teleoperation {
namespace {

using spatial::Vector6;

class ComparatorsTest : public ::testing::Test {
 protected:
  Vector6 any(double size) {
    return Vector6::NullaryExpr([&] { return size * normal_(random_); });
  }
  std::mt19937 random_{23};
  std::normal_distribution<double> normal_;
};

TEST_F(ComparatorsTest, AWaveCarriesThePowerOfItsPort) {
  const WaveTerminal terminal(0.01, 5);
  for (int i = 0; i < 100; ++i) {
    const Vector6 V = any(1), in = any(1);
    const Vector6 F = terminal.force(V, in), out = terminal.out(V, in);
    EXPECT_NEAR(F.dot(V), 0.5 * (out.squaredNorm() - in.squaredNorm()), 1e-9 * (1 + F.norm() * V.norm()));
  }
}

TEST_F(ComparatorsTest, ALineOfWavesNeverGivesMoreThanItGotWhateverTheDelay) {
  for (std::size_t delay : {0u, 1u, 37u}) {
    const WaveTerminal a(0.01, 5), b(0.01, 5);
    std::deque<Vector6> to_b(delay + 1, Vector6::Zero()), to_a(delay + 1, Vector6::Zero());
    double energy = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vector6 Va = any(1), Vb = any(1);
      energy += a.force(Va, to_a.front()).dot(Va) + b.force(Vb, to_b.front()).dot(Vb);
      to_b.push_back(a.out(Va, to_a.front()));
      to_a.push_back(b.out(Vb, to_b.front()));
      to_b.pop_front();
      to_a.pop_front();
      ASSERT_GE(energy, -1e-9);
    }
  }
}

TEST_F(ComparatorsTest, AnEndGivesOutNoMoreThanTheOtherIsKnownToHavePutIn) {
  const Vector6 metric = Vector6::Ones();
  PassivityEnd master, slave;
  double learnt = 0;
  for (int i = 0; i < 2000; ++i) {
    if (i % 7 == 0) learnt = slave.energy_in_J();
    master.learn(learnt);
    slave.learn(master.energy_in_J());
    const Vector6 V = any(0.1), F = any(3);
    (void)master.damped_force(F, V, metric, 1e-3, 1e9);
    (void)slave.yielding_velocity(any(3), any(0.1), 1e-3);
    ASSERT_LE(master.energy_out_J(), learnt + 1e-9);
    ASSERT_LE(slave.energy_out_J(), master.energy_in_J() + 1e-9);
  }
}

}  // namespace
}  // namespace farfeel::teleoperation
