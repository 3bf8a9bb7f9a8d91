// Two plates facing each other, posed by hand: S with its normal along C's z axis, T above it and turned over.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "haptic_core/penetration/reference/reference.h"
#include "tests/support/plates.h"

namespace farfeel::penetration {

/// A plate of ridges across the direction at turn_rad.
inline geometry::HapticSurface waves(const support::PlateSize& size, double period_m, double height_m,
                                     double turn_rad) {
  return support::textured_plate(size, [=](double x, double y) {
    return 0.5 * height_m *
           std::cos(2 * std::numbers::pi * (std::cos(turn_rad) * x + std::sin(turn_rad) * y) / period_m);
  });
}

/// T's plate faces -z in C when its pose is this one moved by a translation.
inline const glm::dquat kTurnedOver{0, 1, 0, 0};  // half a turn about x

struct Plates {
  geometry::HapticSurface s_surface, t_surface;
  FeltSurface s{s_surface}, t{t_surface};
  std::vector<std::uint32_t> all{0, 1};
  spatial::Pose X_CS, X_CT{kTurnedOver, {0, 0, 0}};
  Window window{{-0.004, -0.004}, {0.004, 0.004}};

  Plates(geometry::HapticSurface s_plate, geometry::HapticSurface t_plate)
      : s_surface(std::move(s_plate)), t_surface(std::move(t_plate)) {}
  Plates(const Plates&) = delete;
  Plates& operator=(const Plates&) = delete;

  [[nodiscard]] Query query(double soft_width_m = kDefaultSoftWidth_m, std::uint32_t samples = 50) const {
    return {.s = {&s, X_CS, all},
            .t = {&t, X_CT, all},
            .window = window,
            .samples = samples,
            .soft_width_m = soft_width_m,
            .wants_hessian = true};
  }
};

inline Penetration evaluate(BackEnd& back_end, const Query& query) {
  Penetration answer;
  back_end.evaluate({&query, 1}, {&answer, 1});
  return answer;
}

/// T moved by a small rotation about To and a translation, in C.
inline spatial::Pose moved(const spatial::Pose& X_CT, const spatial::Vector6& q) {
  return {glm::normalize(spatial::rotation_from_vector({q[0], q[1], q[2]}) * X_CT.R),
          X_CT.p + glm::dvec3{q[3], q[4], q[5]}};
}

/// Central differences of depth and gradient over T's pose, coordinate by coordinate; rotations by lever / arm.
struct Differences {
  spatial::Vector6 gradient;
  spatial::Matrix6 hessian;
};
inline Differences differences(BackEnd& back_end, Plates& plates, Query query, double step_m, double arm_m = 0.01) {
  const spatial::Pose X_CT = plates.X_CT;
  Differences result;
  for (int k = 0; k < 6; ++k) {
    const double h = k < 3 ? step_m / arm_m : step_m;
    query.t.X_CO = moved(X_CT, h * spatial::Vector6::Unit(k));
    const Penetration up = evaluate(back_end, query);
    query.t.X_CO = moved(X_CT, -h * spatial::Vector6::Unit(k));
    const Penetration down = evaluate(back_end, query);
    result.gradient[k] = (up.depth_m - down.depth_m) / (2 * h);
    result.hessian.col(k) = (up.gradient - down.gradient) / (2 * h);
  }
  // Rotations do not commute: differences of the gradient carry half a commutator, which is antisymmetric.
  result.hessian = (0.5 * (result.hessian + result.hessian.transpose())).eval();
  return result;
}

}  // namespace farfeel::penetration
