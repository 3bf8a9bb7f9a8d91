#include "master_station/devices/model/calibration.h"

namespace farfeel::devices {

bool Calibration::operator==(const Calibration& other) const {
  return R_BA == other.R_BA && units_per_N == other.units_per_N && offset_B_m == other.offset_B_m &&
         gravity_B_N == other.gravity_B_N && neutral.turn == other.neutral.turn && neutral.push == other.neutral.push;
}

Sample calibrated(const Calibration& calibration, const Sample& in_A) noexcept {
  const glm::dmat3& R = calibration.R_BA;
  const glm::dquat q = glm::quat_cast(R);
  Sample in_B = in_A;
  // The handle's own axes turn along, so that a handle at rest in A is at rest in B.
  in_B.X_BD = {q * in_A.X_BD.R * glm::conjugate(q), R * in_A.X_BD.p + calibration.offset_B_m};
  in_B.V_BD_B = {R * in_A.V_BD_B.angular_rad_s, R * in_A.V_BD_B.linear_m_s};
  const auto deflected = [&](const glm::dvec3& v, const glm::dvec3& neutral) {
    return R * glm::clamp(v - neutral, glm::dvec3(-1), glm::dvec3(1));
  };
  in_B.deflection = {deflected(in_A.deflection.turn, calibration.neutral.turn),
                     deflected(in_A.deflection.push, calibration.neutral.push)};
  return in_B;
}

spatial::Wrench for_device(const Calibration& calibration, const spatial::Wrench& F_B) noexcept {
  const double units = calibration.units_per_N;
  return {units * F_B.torque_Nm * calibration.R_BA, units * F_B.force_N * calibration.R_BA};  // by the transpose
}

}  // namespace farfeel::devices
