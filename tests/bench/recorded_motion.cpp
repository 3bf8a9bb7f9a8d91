#include "tests/bench/recorded_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "haptic_core/collision/proximity_query.h"
#include "haptic_core/contact/tracking/clustering.h"
#include "haptic_core/contact/tracking/crossed_sheets.h"

namespace farfeel::bench {
namespace {

using glm::dvec3;

constexpr int kMostRounds = 120;  // of looking for a motion as wanted; one in twenty or so is
constexpr double kSpread = 0.25;  // of S's size, either way from its centre: where places are drawn
constexpr double kMostSpeed_m_per_s = 0.3;
constexpr double kTick_s = 1e-3, kMostLift_m = 2e-4, kSlowest_m_per_s = 0.01, kFastest_m_per_s = 0.16;

/// A sum of slow sines within [-1, 1].
class Wander {
 public:
  template <typename Random>
  Wander(Random& random, double slowest_hz, double fastest_hz) {
    std::uniform_real_distribution<double> phase(0, 2 * std::numbers::pi), rate(slowest_hz, fastest_hz);
    for (auto& wave : waves_) wave = {phase(random), 2 * std::numbers::pi * rate(random)};
  }
  [[nodiscard]] double at(double time_s) const {
    double sum = 0;
    for (const auto& [phase, rate] : waves_) sum += std::sin(phase + rate * time_s);
    return sum / double(waves_.size());
  }

 private:
  std::array<std::pair<double, double>, 3> waves_;
};

double minimum_jerk(double t) {
  return t * t * t * (10 - t * (15 - 6 * t));
}

double deepest(std::span<const collision::ProximityPair> pairs, double tolerance_m) {
  double depth = -tolerance_m;
  for (const auto& pair : pairs) {
    if (pair.facing > 0.2) depth = std::max(depth, -pair.distance_m);
  }
  return depth;
}

}  // namespace

MotionBodies::MotionBodies(const geometry::HapticSurface& felt_s, const geometry::HapticSurface& felt_t)
    : S(collision::ConvexPieces(felt_s)), T(collision::ConvexPieces(felt_t)), crossed(felt_s, S, felt_t, T) {}

std::vector<spatial::Pose> recorded_motion(MotionBodies& bodies, double tolerance_m, const MotionPlan& plan,
                                           std::uint64_t seed, std::size_t frames) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const Wander turn(random, 0.1, 0.6), tilt_x(random, 0.2, 0.9), tilt_y(random, 0.2, 0.9), press(random, 0.4, 2.5);
  collision::ProximityQuery query(bodies.S, bodies.T);

  const auto somewhere = [&] {
    dvec3 p = plan.region_low_m;
    for (int k = 0; k < 2; ++k) p[k] += uniform(random) * (plan.region_high_m[k] - plan.region_low_m[k]);
    return p;
  };
  dvec3 from = somewhere(), to = from;
  double start_s = 0, end_s = 0;
  int strokes = 0;
  double height = plan.region_high_m.z;
  const auto pose_at = [&](double time_s) {
    if (time_s >= end_s) {
      const dvec3 last = from;
      from = to;
      to = ++strokes % 3 == 0 ? last : somewhere();
      const double speed = kSlowest_m_per_s * std::pow(kFastest_m_per_s / kSlowest_m_per_s, uniform(random));
      start_s = time_s, end_s = time_s + std::max(0.05, glm::distance(from, to) / speed);
    }
    dvec3 p = from + minimum_jerk((time_s - start_s) / (end_s - start_s)) * (to - from);
    p.z = height;
    const auto R =
        spatial::rotation_from_vector({plan.tilt_rad * tilt_x.at(time_s), plan.tilt_rad * tilt_y.at(time_s), 0}) *
        spatial::rotation_from_vector({0, 0, plan.turn_rad * turn.at(time_s)}) * plan.X_ST_rest.R;
    return spatial::Pose{glm::normalize(R), p};
  };

  std::vector<spatial::Pose> poses;
  poses.reserve(frames);
  const double middle = 0.5 * (plan.depth_low_m + plan.depth_high_m),
               reach = 0.5 * (plan.depth_high_m - plan.depth_low_m);
  for (std::size_t frame = 0; poses.size() < frames; ++frame) {
    const double time_s = double(frame) * kTick_s;
    const spatial::Pose pose = pose_at(time_s);
    const double depth =
        deepest(bodies.crossed.mended(query.nearer_than(tolerance_m, pose), tolerance_m, pose), tolerance_m);
    const bool has_arrived = depth > -tolerance_m || !poses.empty();
    if (has_arrived) poses.push_back(pose);
    const double error = depth - (middle + 1.7 * reach * press.at(time_s));
    height += has_arrived ? std::clamp(0.3 * error, -kMostLift_m, kMostLift_m) : -kMostLift_m;
  }
  return poses;
}

MotionCharacter character_of(const collision::HullTree& S, const collision::HullTree& T, double tolerance_m,
                             const std::vector<spatial::Pose>& motion) {
  collision::ProximityQuery query(S, T);
  contact::Clustering clustering;
  MotionCharacter c;
  double touching = 0, squares = 0;
  std::vector<double> speeds;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const auto near = query.nearer_than(tolerance_m, motion[i]);
    const auto clusters = clustering.update(near, tolerance_m, kTick_s);
    const auto touches = [](const collision::ProximityPair& p) { return p.distance_m < 0 && p.facing > 0; };
    c.pairs_mean += double(near.size()) / double(motion.size());
    squares += double(near.size() * near.size()) / double(motion.size());
    if (std::any_of(near.begin(), near.end(), touches)) touching += 1, c.contacts_mean += double(clusters.size());
    if (i > 0) speeds.push_back(glm::distance(motion[i].p, motion[i - 1].p) / kTick_s);
  }
  c.contacts_mean /= std::max(1.0, touching);
  c.pairs_deviation = std::sqrt(std::max(0.0, squares - c.pairs_mean * c.pairs_mean));
  c.contact_share = touching / double(motion.size());
  std::sort(speeds.begin(), speeds.end());
  c.fastest_m_per_s = speeds.back(), c.median_m_per_s = speeds[speeds.size() / 2];
  return c;
}

std::vector<spatial::Pose> recorded_motion_like(MotionBodies& bodies, double tolerance_m, const MotionPlan& plan,
                                                std::uint64_t seed, std::size_t frames, const MotionWanted& wanted) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const dvec3 low = bodies.S.pieces().box.low, high = bodies.S.pieces().box.high;
  std::pair<double, double> best_is{1e300, 0};  // how far from wanted, how much the pairs vary
  std::vector<spatial::Pose> best;
  for (int round = 0; round < kMostRounds && best_is > std::pair(0.0, wanted.pairs_within); ++round) {
    MotionPlan here = plan;
    const dvec3 shift = kSpread * (high - low) * dvec3(uniform(random), uniform(random), 0);
    here.region_low_m += shift, here.region_high_m += shift;
    here.X_ST_rest.R = spatial::rotation_from_vector({0, 0, std::numbers::pi * uniform(random)}) * plan.X_ST_rest.R;
    const std::uint64_t of_motion = random();
    const auto beginning = recorded_motion(bodies, tolerance_m, here, of_motion, frames / 5 + 1);
    const MotionCharacter so_far = character_of(bodies.S, bodies.T, tolerance_m, beginning);
    if (std::abs(so_far.pairs_mean - wanted.pairs) > 3 * wanted.pairs_within && !best.empty()) continue;
    auto motion = recorded_motion(bodies, tolerance_m, here, of_motion, frames);
    const MotionCharacter c = character_of(bodies.S, bodies.T, tolerance_m, motion);
    const double falls_short = std::max(0.0, std::abs(c.pairs_mean - wanted.pairs) / wanted.pairs_within - 1) +
                               std::max(0.0, 1 - c.contacts_mean / wanted.contacts) +
                               std::max(0.0, 1 - c.contact_share / wanted.contact_share) +
                               std::max(0.0, c.fastest_m_per_s / kMostSpeed_m_per_s - 1);
    const std::pair is{falls_short, c.pairs_deviation};
    if (is < best_is) best_is = is, best = std::move(motion);
  }
  return best;
}

}  // namespace farfeel::bench
