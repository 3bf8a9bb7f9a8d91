#include "master_station/devices/plug_in/plug_in_values.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>

namespace farfeel::devices {
namespace {

// What no device that a hand holds goes beyond. Wide: these are to catch a wrong unit, byte order or sign, not a strong
// device, whose forces are limited by whoever feels it.
constexpr double kFar_m = 10;
constexpr double kFast_m_s = 100, kFast_rad_s = 1000;
constexpr double kStrong_N = 1000, kStrong_Nm = 100;
constexpr double kOrientationSlack = 1e-3;
constexpr double kDeflectionSlack = 1e-6;
constexpr std::int64_t kFuture_ns = 1'000'000;  ///< of a clock that two CPUs read

template <std::size_t kSize>
std::optional<std::string_view> text_in(const char (&array)[kSize]) noexcept {
  const std::size_t length = strnlen(array, kSize);
  if (length == kSize) return std::nullopt;
  return std::string_view(array, length);
}

bool is_printable(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return c >= 0x20 && c != 0x7f; });
}

bool is_word(std::string_view text, bool is_model) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) {
    if (!is_model) return c > ' ' && c <= '~' && c != '#';
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
  });
}

bool is_within(const double (&v)[3], double most) noexcept {
  return std::all_of(v, v + 3, [&](double c) { return std::abs(c) <= most; });  // false for NaN
}

glm::dvec3 vector(const double (&v)[3]) noexcept {
  return {v[0], v[1], v[2]};
}

tl::unexpected<std::string> refusal(std::string why) {
  return tl::unexpected<std::string>(std::move(why));
}

struct Figure {
  const char* name;
  double value, least, most;
};

}  // namespace

tl::expected<FoundDevice, std::string> checked(const farfeel_device_found& found, const std::string& library) {
  const auto model = text_in(found.model), serial = text_in(found.serial), id = text_in(found.id),
             trouble = text_in(found.trouble);
  if (!model || !serial || !id || !trouble) return refusal("find() left a string without its ending zero");
  if (!is_word(*model, true))
    return refusal("find() gave a model that is empty or has other characters than a to z, 0 to 9 and -");
  if (!is_word(*id, false)) return refusal("find() gave an id that is empty or not printable ASCII");
  if (!is_printable(*serial) || !is_printable(*trouble)) return refusal("find() gave a text with control characters");
  return FoundDevice{.model = std::string(*model),
                     .serial = std::string(*serial),
                     .path = library + "#" + std::string(*id),
                     .trouble = std::string(*trouble)};
}

std::string library_of(const std::string& path) {
  return path.substr(0, path.rfind('#'));
}

tl::expected<farfeel_device_found, std::string> found_again(const FoundDevice& device) {
  const std::size_t at = device.path.rfind('#');
  if (at == std::string::npos) return refusal("\"" + device.path + "\" is not of the form LIBRARY#ID");
  farfeel_device_found found{};
  found.struct_size = sizeof found;
  const auto put = [](const std::string& text, auto& array) {
    if (text.size() >= sizeof array) return false;
    std::memcpy(array, text.data(), text.size());
    return true;
  };
  if (!put(device.model, found.model) || !put(device.serial, found.serial) ||
      !put(device.path.substr(at + 1), found.id) || !put(device.trouble, found.trouble))
    return refusal("a name in \"" + device.path + "\" is too long");
  return found;
}

tl::expected<DeviceModel, std::string> checked(const farfeel_device_description& is, const std::string& name) {
  const auto title = text_in(is.title), estimated = text_in(is.estimated);
  if (!title || !estimated) return refusal("describe() left a string without its ending zero");
  if (!is_printable(*title) || !is_printable(*estimated))
    return refusal("describe() gave a text with control characters");
  const double inf = std::numeric_limits<double>::infinity();
  const Figure figures[] = {{"tells", double(is.tells), 0, 1},
                            {"position_dof", double(is.position_dof), 0, 3},
                            {"rotation_dof", double(is.rotation_dof), 0, 3},
                            {"force_dof", double(is.force_dof), 0, 3},
                            {"torque_dof", double(is.torque_dof), 0, 3},
                            {"is_in_newtons", double(is.is_in_newtons), 0, 1},
                            {"enable_button", double(is.enable_button), -1, 31},
                            {"clutch_button", double(is.clutch_button), -1, 31},
                            {"position_step_m", is.position_step_m, is.position_dof > 0 ? 1e-9 : 0, 0.1},
                            {"rotation_step_rad", is.rotation_step_rad, is.rotation_dof > 0 ? 1e-9 : 0, 1},
                            {"rate_Hz", is.rate_Hz, 1, 20'000},
                            {"sensor_delay_s", is.sensor_delay_s, 0, 1},
                            {"actuator_delay_s", is.actuator_delay_s, 0, 1},
                            {"holds_force_s", is.holds_force_s, 0, inf},
                            {"mass_kg", is.mass_kg, 0, 100},
                            {"inertia_kg_m2", is.inertia_kg_m2, 0, 10},
                            {"viscous_friction_Ns_per_m", is.viscous_friction_Ns_per_m, 0, 1000},
                            {"coulomb_friction_N", is.coulomb_friction_N, 0, 100},
                            {"viscous_friction_Nms_per_rad", is.viscous_friction_Nms_per_rad, 0, 100},
                            {"coulomb_friction_Nm", is.coulomb_friction_Nm, 0, 10},
                            {"max_force_N", is.max_force_N, 0, is.force_dof > 0 ? kStrong_N : 0},
                            {"continuous_force_N", is.continuous_force_N, 0, is.max_force_N},
                            {"max_torque_Nm", is.max_torque_Nm, 0, is.torque_dof > 0 ? kStrong_Nm : 0},
                            {"continuous_torque_Nm", is.continuous_torque_Nm, 0, is.max_torque_Nm},
                            {"thermal_time_s", is.thermal_time_s, 0, 10'000},
                            {"full_speed_m_s", is.full_speed_m_s, 0, kFast_m_s},
                            {"full_rotation_rad_s", is.full_rotation_rad_s, 0, kFast_rad_s}};
  for (const Figure& figure : figures)
    if (!(figure.value >= figure.least && figure.value <= figure.most))
      return refusal(fmt::format("describe() gave {} = {}, which has to be from {} to {}", figure.name, figure.value,
                                 figure.least, figure.most));
  if (!is_within(is.workspace_min_B_m, kFar_m) || !is_within(is.workspace_max_B_m, kFar_m))
    return refusal("describe() gave a workspace that is not finite or larger than 10 m");
  for (int i = 0; i < 3; ++i)
    if (is.workspace_min_B_m[i] > is.workspace_max_B_m[i] ||
        (is.position_dof == 3 && is.tells == FARFEEL_DEVICE_TELLS_POSE &&
         is.workspace_min_B_m[i] == is.workspace_max_B_m[i]))
      return refusal("describe() gave a workspace without volume");

  DeviceModel model;
  model.name = name;
  model.title = title->empty() ? name : std::string(*title);
  model.tells = is.tells == FARFEEL_DEVICE_TELLS_RATE ? Tells::kRate : Tells::kPose;
  model.position_dof = is.position_dof, model.rotation_dof = is.rotation_dof;
  model.force_dof = is.force_dof, model.torque_dof = is.torque_dof;
  model.is_in_newtons = is.is_in_newtons != 0;
  model.workspace_min_B_m = vector(is.workspace_min_B_m), model.workspace_max_B_m = vector(is.workspace_max_B_m);
  model.position_step_m = is.position_step_m, model.rotation_step_rad = is.rotation_step_rad;
  model.rate_Hz = is.rate_Hz;
  model.sensor_delay_s = is.sensor_delay_s, model.actuator_delay_s = is.actuator_delay_s;
  model.holds_force_s = is.holds_force_s;
  model.mass_kg = is.mass_kg, model.inertia_kg_m2 = is.inertia_kg_m2;
  model.viscous_friction_Ns_per_m = is.viscous_friction_Ns_per_m, model.coulomb_friction_N = is.coulomb_friction_N;
  model.viscous_friction_Nms_per_rad = is.viscous_friction_Nms_per_rad;
  model.coulomb_friction_Nm = is.coulomb_friction_Nm;
  model.max_force_N = is.max_force_N, model.continuous_force_N = is.continuous_force_N;
  model.max_torque_Nm = is.max_torque_Nm, model.continuous_torque_Nm = is.continuous_torque_Nm;
  model.thermal_time_s = is.thermal_time_s;
  model.full_speed_m_s = is.full_speed_m_s, model.full_rotation_rad_s = is.full_rotation_rad_s;
  model.enabling = is.enable_button >= 0 ? Enabling::kHold : Enabling::kStation;
  model.enable_button = is.enable_button, model.clutch_button = is.clutch_button;
  for (std::size_t at = 0; at < estimated->size();) {
    const std::size_t comma = std::min(estimated->find(',', at), estimated->size());
    std::string_view word = estimated->substr(at, comma - at);
    word.remove_prefix(std::min(word.find_first_not_of(' '), word.size()));
    word = word.substr(0, word.find(' '));
    if (!word.empty()) model.estimated.emplace_back(word);
    at = comma + 1;
  }
  return model;
}

const char* fault_of(const farfeel_device_sample& sample, const farfeel_device_sample& before,
                     std::int64_t now_ns) noexcept {
  if (sample.time_ns < 0 || sample.time_ns > now_ns + kFuture_ns) return "a time_ns in the future or below 0";
  if (sample.seen_ns < 0 || sample.seen_ns > now_ns + kFuture_ns) return "a seen_ns in the future or below 0";
  if (sample.time_ns < before.time_ns || sample.seen_ns < before.seen_ns) return "a time that goes back";
  if (sample.reports < before.reports) return "fewer reports than before";
  if (!is_within(sample.position_m, kFar_m)) return "a position that is not finite or 10 m away";
  double square = 0;
  for (const double c : sample.orientation) square += c * c;
  if (!(std::abs(std::sqrt(square) - 1) <= kOrientationSlack)) return "an orientation that is no unit quaternion";
  if (!is_within(sample.velocity_m_s, kFast_m_s) || !is_within(sample.angular_velocity_rad_s, kFast_rad_s))
    return "a velocity that is not finite or above 100 m/s or 1000 rad/s";
  if (!is_within(sample.turn, 1 + kDeflectionSlack) || !is_within(sample.push, 1 + kDeflectionSlack))
    return "a deflection that is not finite or above 1";
  return nullptr;
}

Sample sample_from(const farfeel_device_sample& is) noexcept {
  Sample sample;
  sample.time_ns = is.time_ns;
  sample.polled_ns = is.seen_ns;
  sample.reports = is.reports;
  sample.X_BD.R =
      glm::normalize(glm::dquat(is.orientation[0], is.orientation[1], is.orientation[2], is.orientation[3]));
  sample.X_BD.p = vector(is.position_m);
  if (is.has_velocity != 0)
    sample.V_BD_B = {.angular_rad_s = vector(is.angular_velocity_rad_s), .linear_m_s = vector(is.velocity_m_s)};
  sample.deflection.turn = glm::clamp(vector(is.turn), -1.0, 1.0);
  sample.deflection.push = glm::clamp(vector(is.push), -1.0, 1.0);
  sample.buttons = is.buttons;
  return sample;
}

const char* fault_of(const farfeel_device_zero_force& is) noexcept {
  if (is.fd < 0 || fcntl(is.fd, F_GETFD) < 0) return "a descriptor that is not open";
  if (is.size < 1 || is.size > sizeof is.bytes) return "a size that is not from 1 to 128";
  if (is.is_usb_bulk != 0 && (is.endpoint < 1 || is.endpoint > 15)) return "an endpoint that is not from 1 to 15";
  return nullptr;
}

}  // namespace farfeel::devices
