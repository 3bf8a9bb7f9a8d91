// For an arm at phi, with u outwards, v along the base's side and w = z, a point of the grip is
//     U = u - r + c,  V = v - s + f,  W = z,
// counted from the shoulder and reduced by the grip's own offsets, so that the shin's ends are the elbow (a cos theta,
// 0, a sin theta) and (U, V, W). The shin is a parallelogram of length b with a joint of length d at each end that
// stays in the arm's plane. With e the unit vector in that plane from elbow to grip and rho the distance there,
//     (rho - 2 d)^2 + V^2 = b^2. (1)
// Inverse: rho is known, and (U - a cos)^2 + (W - a sin)^2 = rho^2 is a quadratic in tan(theta / 2).
// Statics: n = ((rho - 2 d) e + V v) / b is the unit vector along the shin; dp . n_i = lever_i dtheta_i with
// lever = a n . (-sin, 0, cos). With rows n_i in N: J = N^-1 diag(lever), tau = J^T F.
#include "codecs/device/falcon_kinematics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfeel::codecs {

namespace {

constexpr double kUpperArm_m = 0.060;                           // a
constexpr double kShin_m = 0.1025;                              // b
constexpr double kShinJoints_m = 2 * 0.01125;                   // d + e
constexpr double kGripOut_m = 0.01443, kGripAlong_m = -0.025;   // c, f
constexpr double kBaseOut_m = 0.0400, kBaseAlong_m = -0.02309;  // r, s
constexpr double kReach_m = kShin_m + kShinJoints_m;            // of a shin whose ends face each other
constexpr double kRadiansPerCount = 2 * std::numbers::pi / (4 * 320) * 0.01425 / 0.110;
constexpr double kRadiansAtZero = 35 * std::numbers::pi / 180;

struct Leg {
  glm::dvec3 u, v;
};

const std::array<Leg, 3> kLegs = [] {
  std::array<Leg, 3> legs{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double phi = (105 - 120.0 * static_cast<double>(i)) * std::numbers::pi / 180;
    legs[i] = {{std::cos(phi), std::sin(phi), 0}, {-std::sin(phi), std::cos(phi), 0}};
  }
  return legs;
}();

constexpr glm::dvec3 kW{0, 0, 1};

/// U, V, W of the grip at p.
glm::dvec3 from_shoulder(const Leg& leg, const glm::dvec3& p) noexcept {
  return {glm::dot(leg.u, p) - kBaseOut_m + kGripOut_m, glm::dot(leg.v, p) - kBaseAlong_m + kGripAlong_m, p.z};
}

/// A shin: its unit vector from elbow to grip, its length's difference from b, and the arm's lever.
struct Shin {
  glm::dvec3 n;
  double error_m, lever_m;
};

std::optional<Shin> shin(const Leg& leg, const glm::dvec3& p, double theta) noexcept {
  const glm::dvec3 from = from_shoulder(leg, p);
  const double U = from.x - kUpperArm_m * std::cos(theta), W = from.z - kUpperArm_m * std::sin(theta);
  const double rho = std::hypot(U, W);
  if (!(rho > kShinJoints_m)) return std::nullopt;
  const glm::dvec3 e = (U * leg.u + W * kW) / rho;
  const glm::dvec3 along = (rho - kShinJoints_m) * e + from.y * leg.v;
  const double length = glm::length(along);
  const glm::dvec3 turn = -std::sin(theta) * leg.u + std::cos(theta) * kW;
  const glm::dvec3 n = along / length;
  return Shin{n, length - kShin_m, kUpperArm_m * glm::dot(n, turn)};
}

/// Where three spheres of the shins' reach meet, on the person's side; on their middle line where they do not meet.
std::optional<glm::dvec3> where_spheres_meet(const FalconAngles& angles) noexcept {
  std::array<glm::dvec3, 3> centre;
  for (std::size_t i = 0; i < 3; ++i) {
    const Leg& leg = kLegs[i];
    centre[i] = (kBaseOut_m - kGripOut_m + kUpperArm_m * std::cos(angles[i])) * leg.u +
                (kBaseAlong_m - kGripAlong_m) * leg.v + kUpperArm_m * std::sin(angles[i]) * kW;
  }
  // Their centres' circumcentre, and up from there along the normal of their plane.
  const glm::dvec3 a = centre[1] - centre[0], b = centre[2] - centre[0];
  const glm::dvec3 normal = glm::cross(a, b);
  const double area2 = glm::dot(normal, normal);
  constexpr double kLeastArea_m2 = 1e-6;
  if (!(area2 > kLeastArea_m2 * kLeastArea_m2)) return std::nullopt;
  const glm::dvec3 middle =
      (glm::dot(a, a) * glm::cross(b, normal) + glm::dot(b, b) * glm::cross(normal, a)) / (2 * area2);
  const double height = std::sqrt(std::max(0.0, kReach_m * kReach_m - glm::dot(middle, middle)));
  return centre[0] + middle + normal * (height / std::sqrt(area2) * (normal.z < 0 ? -1 : 1));
}

/// N of three shins, as rows; its determinant is their volume.
glm::dmat3 rows(const std::array<Shin, 3>& shins) noexcept {
  return glm::transpose(glm::dmat3(shins[0].n, shins[1].n, shins[2].n));
}

bool is_finite(const glm::dvec3& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

std::optional<std::array<Shin, 3>> all_shins(const glm::dvec3& p, const FalconAngles& angles) noexcept {
  std::array<Shin, 3> shins;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto one = shin(kLegs[i], p, angles[i]);
    if (!one) return std::nullopt;
    shins[i] = *one;
  }
  return shins;
}

}  // namespace

FalconAngles falcon_angles_of_counts(const std::array<std::int16_t, 3>& counts) noexcept {
  FalconAngles angles{};
  for (std::size_t i = 0; i < 3; ++i) angles[i] = kRadiansAtZero + kRadiansPerCount * counts[i];
  return angles;
}

std::optional<FalconAngles> falcon_angles(const glm::dvec3& p_F) noexcept {
  FalconAngles angles{};
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 from = from_shoulder(kLegs[i], p_F);
    const double U = from.x, W = from.z, a = kUpperArm_m;
    const double sine = kShin_m * kShin_m - from.y * from.y;
    if (!(sine >= 0) || !(W > 0)) return std::nullopt;
    const double rho = kShinJoints_m + std::sqrt(sine);
    const double K = U * U + W * W + a * a - rho * rho;
    const double inside = 4 * a * a * (U * U + W * W) - K * K;
    if (!(inside >= 0)) return std::nullopt;  // too far, or too near
    // (K + 2 a U) t^2 - 4 a W t + (K - 2 a U) = 0; the smaller t, written so that nothing cancels.
    angles[i] = 2 * std::atan2(K - 2 * a * U, 2 * a * W + std::sqrt(inside));
  }
  return angles;
}

std::optional<glm::dvec3> falcon_position(const FalconAngles& angles) noexcept {
  constexpr int kMostSteps = 10;
  constexpr double kCloseEnough_m = 1e-12;
  constexpr double kSameAngle_rad = 1e-7;  // 6 nm at the elbow; a count is 6e-4
  constexpr double kLongestStep_m = 0.03;  // a quarter of the reach: further, (1) is no longer near its tangent
  auto p = where_spheres_meet(angles);
  if (!p || !is_finite(*p)) return std::nullopt;
  for (int step = 0; step < kMostSteps; ++step) {
    const auto shins = all_shins(*p, angles);
    if (!shins) return std::nullopt;
    const glm::dmat3 N = rows(*shins);
    constexpr double kNoVolume = 1e-6;
    if (!(std::abs(glm::determinant(N)) > kNoVolume)) return std::nullopt;
    glm::dvec3 move = glm::inverse(N) * -glm::dvec3((*shins)[0].error_m, (*shins)[1].error_m, (*shins)[2].error_m);
    const double length = glm::length(move);
    if (length > kLongestStep_m) move *= kLongestStep_m / length;
    *p += move;
    if (length < kCloseEnough_m) break;
  }
  const auto back = falcon_angles(*p);
  if (!back) return std::nullopt;
  for (std::size_t i = 0; i < 3; ++i)
    if (!(std::abs((*back)[i] - angles[i]) < kSameAngle_rad)) return std::nullopt;
  return p;
}

std::optional<glm::dmat3> falcon_jacobian(const glm::dvec3& p_F, const FalconAngles& angles) noexcept {
  const auto shins = all_shins(p_F, angles);
  if (!shins) return std::nullopt;
  const glm::dmat3 N = rows(*shins);
  if (!(std::abs(glm::determinant(N)) >= kLeastVolume)) return std::nullopt;
  glm::dmat3 J = glm::inverse(N);
  for (int i = 0; i < 3; ++i) {
    const double lever_m = (*shins)[static_cast<std::size_t>(i)].lever_m;
    if (!(lever_m >= kLeastLever_m)) return std::nullopt;
    J[i] *= lever_m;
  }
  return J;
}

FalconMotors falcon_motors(const glm::dmat3& jacobian, const glm::dvec3& force_F_N) noexcept {
  const glm::dvec3 values = -kFalconUnitsPerNm * (glm::transpose(jacobian) * force_F_N);
  if (!is_finite(values)) return {};
  const double largest = std::max({std::abs(values.x), std::abs(values.y), std::abs(values.z)});
  FalconMotors motors{.values = {}, .share = largest > kMostFalconValue ? kMostFalconValue / largest : 1};
  for (int i = 0; i < 3; ++i)
    motors.values[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(std::lround(values[i] * motors.share));
  return motors;
}

}  // namespace farfeel::codecs
