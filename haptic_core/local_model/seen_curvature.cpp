#include "haptic_core/local_model/seen_curvature.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/local_model/constants.h"

namespace farfeel::local_model {
namespace {

using spatial::Matrix6;
using spatial::Vector6;

/// Squared, of each column, where rotations are lengths at kArm_m.
Vector6 sizes_of(const Matrix6& L) {
  return (L.topRows<3>().colwise().squaredNorm() / (kArm_m * kArm_m) + L.bottomRows<3>().colwise().squaredNorm())
      .transpose();
}

}  // namespace

// H <- H - H s (H s)^T / (s.H s) + y y^T / (y.s): what H said along the way s goes, what was seen there comes, if it is
// more. Less means a flank between two turns: it lasts until that is forgotten.
void SeenCurvature::see(const Vector6& way, const Vector6& turn) noexcept {
  if (ablated(Mechanism::kSeenCurvature)) return;
  Vector6 s = way, y = turn;
  s.head<3>() *= kArm_m;
  y.head<3>() /= kArm_m;
  const double way_m = s.norm(), turned = y.norm(), ys = y.dot(s);
  if (!(way_m > kLeastTurnWay_m) || turned == 0 || !std::isfinite(turned)) return;
  L_ *= std::exp(-0.5 * way_m / kForgotten_m);
  const Vector6 w = L_.transpose() * way;
  const double sHs = w.squaredNorm();
  if (ys < kLeastCosine * turned * way_m || ys <= sHs) return;
  // The right factor is turned first, so that what H said along s is one column alone: that is the one replaced.
  int column = 0;
  if (sHs > 0) {
    w.cwiseAbs().maxCoeff(&column);
    Vector6 mirror = w / std::copysign(std::sqrt(sHs), w[column]);
    mirror[column] += 1;
    L_ -= (L_ * mirror) * (2 / mirror.squaredNorm() * mirror.transpose());
  } else {
    sizes_of(L_).minCoeff(&column);
  }
  L_.col(column) = turn / std::sqrt(ys);
}

void SeenCurvature::turn(const glm::dquat& R) noexcept {
  const Eigen::Matrix3d R_W = Eigen::Quaterniond(R.w, R.x, R.y, R.z).toRotationMatrix();
  L_.topRows<3>() = R_W * L_.topRows<3>().eval();
  L_.bottomRows<3>() = R_W * L_.bottomRows<3>().eval();
}

double SeenCurvature::whole_N_per_m(double force_N) const noexcept {
  return force_N * sizes_of(L_).sum();
}

Matrix6 SeenCurvature::beyond(double force_N, double held_N_per_m) const noexcept {
  const double whole = whole_N_per_m(force_N);
  if (!(whole > held_N_per_m)) return Matrix6::Zero();
  return force_N * (1 - held_N_per_m / whole) * matrix();
}

}  // namespace farfeel::local_model
