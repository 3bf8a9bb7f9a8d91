#include "haptic_core/motion/scripted_motion.h"

#include <algorithm>
#include <cmath>

namespace farfeel::motion {
namespace {

using spatial::Pose;
using spatial::Twist;

constexpr double kSamePlace_m = 1e-9, kSameTurn_rad = 1e-6;

/// The steady twist that leads from one key to the next, the shorter way round.
Twist chord(const Keyframe& from, const Keyframe& to) {
  const double h_s = to.at_s - from.at_s;
  return {spatial::vector_from_rotation(to.X_WO.R * glm::conjugate(from.X_WO.R)) / h_s,
          (to.X_WO.p - from.X_WO.p) / h_s};
}

/// The parabola's velocity at the middle one of three keys.
Twist between(const Twist& before, double before_s, const Twist& after, double after_s) {
  const double share = before_s / (before_s + after_s);  // a short gap tells more of the velocity beside it
  return {glm::mix(before.angular_rad_s, after.angular_rad_s, share),
          glm::mix(before.linear_m_s, after.linear_m_s, share)};
}

}  // namespace

std::optional<std::string> fault_of(std::span<const Keyframe> keys, Afterwards afterwards) noexcept {
  if (keys.size() < 2) return "a script needs two keys at least";
  if (keys.size() > kMostKeyframes) return "a script has 256 keys at most";
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (!spatial::is_valid(keys[i].X_WO)) return "a key's pose is none";
    const double least_s = i == 0 ? 0 : keys[i - 1].at_s + kLeastGap_s;
    if (!(keys[i].at_s >= least_s && keys[i].at_s <= kLongestScript_s))
      return "keys' times begin at 0 or later, grow by a millisecond at least, and end before 100,000 s";
  }
  if (afterwards == Afterwards::kRepeats) {
    const Pose &first = keys.front().X_WO, &last = keys.back().X_WO;
    const double turn_rad = glm::length(spatial::vector_from_rotation(last.R * glm::conjugate(first.R)));
    if (glm::distance(first.p, last.p) > kSamePlace_m || turn_rad > kSameTurn_rad)
      return "a script that repeats ends in the pose that it begins with";
  }
  return std::nullopt;
}

ScriptedMotion::ScriptedMotion(std::span<const Keyframe> keys, Afterwards afterwards)
    : keys_(keys.begin(), keys.end()), V_W_(keys.size()), afterwards_(afterwards) {
  const std::size_t last = keys_.size() - 1;
  const auto gap_s = [&](std::size_t i) { return keys_[i + 1].at_s - keys_[i].at_s; };
  for (std::size_t i = 1; i < last; ++i)
    V_W_[i] = between(chord(keys_[i - 1], keys_[i]), gap_s(i - 1), chord(keys_[i], keys_[i + 1]), gap_s(i));
  if (afterwards_ == Afterwards::kRepeats) {
    V_W_.front() = V_W_.back() =
        between(chord(keys_[last - 1], keys_[last]), gap_s(last - 1), chord(keys_[0], keys_[1]), gap_s(0));
  }
}

Placement ScriptedMotion::at(double scene_s) const noexcept {
  const double begin_s = keys_.front().at_s, end_s = keys_.back().at_s;
  if (!(scene_s > begin_s)) return {keys_.front().X_WO, {}};
  double s = scene_s;
  if (s >= end_s) {
    if (afterwards_ == Afterwards::kStays) return {keys_.back().X_WO, {}};
    s = begin_s + std::fmod(s - begin_s, end_s - begin_s);
  }
  const auto next = std::upper_bound(keys_.begin() + 1, keys_.end() - 1, s,
                                     [](double time_s, const Keyframe& key) { return time_s < key.at_s; });
  const auto i = static_cast<std::size_t>(next - keys_.begin()) - 1;
  const Keyframe &a = keys_[i], &b = keys_[i + 1];
  const double h_s = b.at_s - a.at_s, x = (s - a.at_s) / h_s;

  // Bernstein polynomials summed from behind, and their derivatives by x.
  const double y = 1 - x;
  const double b1 = 1 - y * y * y, b2 = x * x * (3 - 2 * x), b3 = x * x * x;
  const double db1 = 3 * y * y, db2 = 6 * x * y, db3 = 3 * x * x;

  const glm::dvec3 v1 = h_s / 3 * V_W_[i].linear_m_s, v3 = h_s / 3 * V_W_[i + 1].linear_m_s,
                   v2 = b.X_WO.p - a.X_WO.p - v1 - v3;
  const glm::dvec3 w1 = h_s / 3 * V_W_[i].angular_rad_s, w3 = h_s / 3 * V_W_[i + 1].angular_rad_s;
  const glm::dvec3 w2 = spatial::vector_from_rotation(spatial::rotation_from_vector(-w3) * b.X_WO.R *
                                                      glm::conjugate(a.X_WO.R) * spatial::rotation_from_vector(-w1));
  const glm::dquat E1 = spatial::rotation_from_vector(b1 * w1), E2 = spatial::rotation_from_vector(b2 * w2),
                   E3 = spatial::rotation_from_vector(b3 * w3);
  return {{glm::normalize(E3 * E2 * E1 * a.X_WO.R), a.X_WO.p + b1 * v1 + b2 * v2 + b3 * v3},
          {(db3 * w3 + E3 * (db2 * w2 + E2 * (db1 * w1))) / h_s, (db1 * v1 + db2 * v2 + db3 * v3) / h_s}};
}

}  // namespace farfeel::motion
