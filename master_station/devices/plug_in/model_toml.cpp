// The figures of a model as text, in the names of device_model.h.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "master_station/devices/plug_in/plug_in_values.h"

namespace farfeel::devices {
namespace {

std::string quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

}  // namespace

std::string toml(const DeviceModel& is) {
  std::string text = fmt::format("title = {}\n", quoted(is.title));
  const auto put = [&](const char* name, auto value) { text += fmt::format("{} = {}\n", name, value); };
  // Always with a decimal point: TOML keeps whole numbers and others apart.
  const auto number = [](double value) {
    const std::string digits = fmt::format("{}", value);
    return digits.find_first_of(".eni") == std::string::npos ? digits + ".0" : digits;
  };
  const auto put_number = [&](const char* name, double value) { put(name, number(value)); };
  const auto put_vector = [&](const char* name, const glm::dvec3& v) {
    put(name, fmt::format("[{}, {}, {}]", number(v.x), number(v.y), number(v.z)));
  };
  put("tells", is.tells == Tells::kPose ? "\"pose\"" : "\"rate\"");
  put("reports", is.reports == Reports::kStream ? "\"stream\"" : "\"events\"");
  put("position_dof", is.position_dof);
  put("rotation_dof", is.rotation_dof);
  put("force_dof", is.force_dof);
  put("torque_dof", is.torque_dof);
  put("is_in_newtons", is.is_in_newtons);
  put_vector("workspace_min_B_m", is.workspace_min_B_m);
  put_vector("workspace_max_B_m", is.workspace_max_B_m);
  const std::pair<const char*, double> figures[] = {{"position_step_m", is.position_step_m},
                                                    {"rotation_step_rad", is.rotation_step_rad},
                                                    {"rate_Hz", is.rate_Hz},
                                                    {"sensor_delay_s", is.sensor_delay_s},
                                                    {"actuator_delay_s", is.actuator_delay_s},
                                                    {"holds_force_s", is.holds_force_s},
                                                    {"mass_kg", is.mass_kg},
                                                    {"inertia_kg_m2", is.inertia_kg_m2},
                                                    {"viscous_friction_Ns_per_m", is.viscous_friction_Ns_per_m},
                                                    {"coulomb_friction_N", is.coulomb_friction_N},
                                                    {"viscous_friction_Nms_per_rad", is.viscous_friction_Nms_per_rad},
                                                    {"coulomb_friction_Nm", is.coulomb_friction_Nm},
                                                    {"max_force_N", is.max_force_N},
                                                    {"continuous_force_N", is.continuous_force_N},
                                                    {"max_torque_Nm", is.max_torque_Nm},
                                                    {"continuous_torque_Nm", is.continuous_torque_Nm},
                                                    {"thermal_time_s", is.thermal_time_s},
                                                    {"full_speed_m_s", is.full_speed_m_s},
                                                    {"full_rotation_rad_s", is.full_rotation_rad_s}};
  for (const auto& [name, value] : figures) put_number(name, value);
  const char* const enablings[] = {"\"hold\"", "\"press\"", "\"station\""};
  put("enabling", enablings[static_cast<std::size_t>(is.enabling)]);
  put("enable_button", is.enable_button);
  put("clutch_button", is.clutch_button);
  std::vector<std::string> estimated;
  for (const std::string& figure : is.estimated) estimated.push_back(quoted(figure));
  put("estimated", fmt::format("[{}]", fmt::join(estimated, ", ")));
  return text;
}

}  // namespace farfeel::devices
