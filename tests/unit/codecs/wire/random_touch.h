// Random poses and contacts, as the haptic lane's tests need them.
#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "codecs/wire/answer_message.h"
#include "codecs/wire/haptic_limits.h"
#include "codecs/wire/pose_message.h"

namespace farfeel::codecs {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double real(double low, double high) { return std::uniform_real_distribution(low, high)(engine_); }
  bool chance(double share) { return real(0, 1) < share; }
  std::uint32_t number() { return static_cast<std::uint32_t>(engine_()); }
  glm::dvec3 vector(double size) { return glm::dvec3{real(-size, size), real(-size, size), real(-size, size)}; }
  glm::dvec3 unit() { return glm::normalize(vector(1) + glm::dvec3(0, 0, 1e-3)); }
  spatial::Pose pose(double size_m = 0.4) {
    return {glm::normalize(glm::dquat(real(-1, 1), real(-1, 1), real(-1, 1), real(-1, 1))), vector(size_m)};
  }

 private:
  std::mt19937_64 engine_;
};

inline PoseMessage random_pose(Random& random) {
  PoseMessage m;
  m.sequence = random.number();
  m.time_us = random.number();
  m.X_WT = random.pose();
  m.V_WT_W = {random.vector(10), random.vector(1)};
  m.times = {random.number(), random.number(), static_cast<std::uint16_t>(random.number())};
  if (random.chance(0.5)) m.heard = static_cast<std::uint16_t>(random.number());
  if (random.chance(0.5)) m.felt_To_W = spatial::Wrench{random.vector(1), random.vector(30)};
  return m;
}

inline contact::Contact random_contact(Random& random, const spatial::Pose& X_WT) {
  contact::Contact c;
  c.id = random.number();
  c.object = random.number() % 256;
  const glm::dvec3 p_ToC_W = random.vector(0.1);
  c.p_WC_W = X_WT.p + p_ToC_W;
  c.nhat_ST_W = random.unit();
  c.depth_m = random.real(-5e-3, 5e-3);
  const glm::dvec3 by_translation = -c.nhat_ST_W + random.vector(0.5);
  c.gradient =
      spatial::to_vector6(spatial::Twist{glm::cross(p_ToC_W, by_translation) + random.vector(1e-3), by_translation});
  c.lateral_range_m = random.real(0, 1e-2);
  c.doubts = static_cast<std::uint8_t>(random.number() & codecs::kWireDoubts);
  c.material = {random.real(100, 5000), random.real(0, 5), random.real(0, 1), random.real(0, 1)};
  return c;
}

inline contact::ContactSet random_set(Random& random, const spatial::Pose& X_WT, std::uint32_t count) {
  contact::ContactSet set;
  set.X_WT = X_WT;
  set.F_To_W = {random.vector(1), random.vector(30)};
  set.pairs_near = random.number() % 1000;
  set.count = count;
  for (std::uint32_t i = 0; i < count; ++i) set.contacts[i] = random_contact(random, X_WT);
  return set;
}

}  // namespace farfeel::codecs
