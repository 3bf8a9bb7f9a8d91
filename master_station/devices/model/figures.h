// The figures of a device's model by name, with what any device can have. A key's end is its unit.
#pragma once

#include <array>
#include <limits>
#include <string_view>
#include <vector>

#include "master_station/devices/model/device_model.h"

namespace farfeel::devices {

struct Figure {
  std::string_view key;
  double DeviceModel::*member;
  double least, most;  ///< from what fingers hardly feel to what no desk carries
};

inline constexpr std::array kFigures{
    Figure{"position_step_m", &DeviceModel::position_step_m, 0, 0.01},
    Figure{"rotation_step_rad", &DeviceModel::rotation_step_rad, 0, 0.2},
    Figure{"rate_Hz", &DeviceModel::rate_Hz, 0, 20000},
    Figure{"sensor_delay_s", &DeviceModel::sensor_delay_s, 0, 0.1},
    Figure{"actuator_delay_s", &DeviceModel::actuator_delay_s, 0, 0.1},
    Figure{"holds_force_s", &DeviceModel::holds_force_s, 0, std::numeric_limits<double>::infinity()},
    Figure{"mass_kg", &DeviceModel::mass_kg, 0, 20},
    Figure{"inertia_kg_m2", &DeviceModel::inertia_kg_m2, 0, 1},
    Figure{"viscous_friction_Ns_per_m", &DeviceModel::viscous_friction_Ns_per_m, 0, 100},
    Figure{"coulomb_friction_N", &DeviceModel::coulomb_friction_N, 0, 20},
    Figure{"viscous_friction_Nms_per_rad", &DeviceModel::viscous_friction_Nms_per_rad, 0, 1},
    Figure{"coulomb_friction_Nm", &DeviceModel::coulomb_friction_Nm, 0, 1},
    Figure{"max_force_N", &DeviceModel::max_force_N, 0, 200},
    Figure{"continuous_force_N", &DeviceModel::continuous_force_N, 0, 200},
    Figure{"max_torque_Nm", &DeviceModel::max_torque_Nm, 0, 20},
    Figure{"continuous_torque_Nm", &DeviceModel::continuous_torque_Nm, 0, 20},
    Figure{"thermal_time_s", &DeviceModel::thermal_time_s, 0, 3600},
    Figure{"max_force_rate_N_per_s", &DeviceModel::max_force_rate_N_per_s, 0, 100000},
    Figure{"max_power_W", &DeviceModel::max_power_W, 0, 500},
    Figure{"max_speed_m_s", &DeviceModel::max_speed_m_s, 0, 20},
    Figure{"full_speed_m_s", &DeviceModel::full_speed_m_s, 0, 2},
    Figure{"full_rotation_rad_s", &DeviceModel::full_rotation_rad_s, 0, 20},
    Figure{"default_workspace_scale", &DeviceModel::default_workspace_scale, 0.001, 1000},
    Figure{"coupling_stiffness_N_per_m", &DeviceModel::coupling_stiffness_N_per_m, 0, 100000},
    Figure{"coupling_damping_Ns_per_m", &DeviceModel::coupling_damping_Ns_per_m, 0, 100},
    Figure{"coupling_stiffness_Nm_per_rad", &DeviceModel::coupling_stiffness_Nm_per_rad, 0, 1000},
    Figure{"coupling_damping_Nms_per_rad", &DeviceModel::coupling_damping_Nms_per_rad, 0, 1},
};

struct Count {
  std::string_view key;
  int DeviceModel::*member;  ///< 0 to 3
};

inline constexpr std::array kCounts{
    Count{"position_dof", &DeviceModel::position_dof}, Count{"rotation_dof", &DeviceModel::rotation_dof},
    Count{"force_dof", &DeviceModel::force_dof}, Count{"torque_dof", &DeviceModel::torque_dof}};

inline constexpr std::array<std::string_view, 10> kOtherKeys{
    "title",     "tells",         "reports",       "enabling",          "is_in_newtons",
    "estimated", "enable_button", "clutch_button", "workspace_min_B_m", "workspace_max_B_m"};

/// All keys that a model's file may have.
[[nodiscard]] inline std::vector<std::string_view> model_keys() {
  std::vector<std::string_view> keys(kOtherKeys.begin(), kOtherKeys.end());
  for (const Figure& figure : kFigures) keys.push_back(figure.key);
  for (const Count& count : kCounts) keys.push_back(count.key);
  return keys;
}

}  // namespace farfeel::devices
