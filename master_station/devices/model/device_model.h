// What is known of a model of device: data, one TOML file a model in this folder, and a person's own file for one
// device, by serial number, over it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::devices {

enum class Tells : std::uint8_t { kPose, kRate };        ///< where it is, or how far it is deflected
enum class Reports : std::uint8_t { kStream, kEvents };  ///< all the time, or only what changes
enum class Enabling : std::uint8_t {
  kHold,    ///< force while the button or grip sensor is held, from its edge on
  kPress,   ///< a press puts force on, the next takes it off
  kStation  ///< the device has no button: a key held at the station, or a foot switch
};

/// Every figure in SI units. [estimated] lists the names of those that nobody published.
struct DeviceModel {
  std::string name, title;  ///< "falcon", "Novint Falcon"
  Tells tells = Tells::kPose;
  Reports reports = Reports::kStream;
  int position_dof = 0, rotation_dof = 0, force_dof = 0, torque_dof = 0;
  bool is_in_newtons = true;  ///< false: force is a share of the greatest, until calibrated
  glm::dvec3 workspace_min_B_m{0}, workspace_max_B_m{0};
  double position_step_m = 0, rotation_step_rad = 0;
  double rate_Hz = 1000;  ///< of its exchange; 0: it is read and written with each tick, as only simulated ones are
  double sensor_delay_s = 0, actuator_delay_s = 0;
  double holds_force_s = 0;  ///< how long it goes on with the last force when nobody speaks to it; infinity: for ever
  double mass_kg = 0;        ///< felt at the handle
  double inertia_kg_m2 = 0;
  double viscous_friction_Ns_per_m = 0, coulomb_friction_N = 0;
  double viscous_friction_Nms_per_rad = 0, coulomb_friction_Nm = 0;
  double max_force_N = 0, continuous_force_N = 0, max_torque_Nm = 0, continuous_torque_Nm = 0;
  double thermal_time_s = 0;  ///< of the force's square; 0: nothing published, no integral
  double max_force_rate_N_per_s = 1000, max_power_W = 10, max_speed_m_s = 2;  ///< of desktop devices, where not told
  double full_speed_m_s = 0, full_rotation_rad_s = 0;  ///< of a rate input at full deflection, by default
  Enabling enabling = Enabling::kStation;
  int enable_button = -1, clutch_button = -1;  ///< -1: none
  double default_workspace_scale = 1;
  /// The stiffest that was found calm on it, at a tick of 1 ms: it comes before the rule (coupling_rule.h); 0: not
  /// known.
  double coupling_stiffness_N_per_m = 0, coupling_damping_Ns_per_m = 0;
  double coupling_stiffness_Nm_per_rad = 0, coupling_damping_Nms_per_rad = 0;
  std::vector<std::string> estimated;

  [[nodiscard]] bool is_estimated(std::string_view figure) const;
};

struct ModelError {
  std::string message;  ///< the file, the line, the figure, its unit, what is allowed
};

/// Of the data that this program was built with.
[[nodiscard]] const DeviceModel* find_model(std::string_view name);
[[nodiscard]] std::vector<std::string> model_names();
/// From TOML, of anybody, with this struct's names as keys; what it does not name stays as in `base`. Values that no
/// device can have are refused. `file` is for messages.
[[nodiscard]] tl::expected<DeviceModel, ModelError> parse_model(std::string_view toml, std::string_view file,
                                                                const DeviceModel& base = {});

}  // namespace farfeel::devices
