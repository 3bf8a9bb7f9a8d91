#include "master_station/devices/hand/hand_words.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

namespace farfeel::devices {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kAlong = 0.9998;  // cosine of a degree

/// Where a direction points in the view; empty: along none of its axes.
std::string_view direction(const glm::dvec3& v) {
  constexpr std::array<std::string_view, 3> kPlus{"right", "away", "up"}, kMinus{"left", "nearer", "down"};
  for (int i = 0; i < 3; ++i) {
    if (std::abs(v[i]) > kAlong) return (v[i] > 0 ? kPlus : kMinus)[static_cast<std::size_t>(i)];
  }
  return {};
}

std::string axes_in_words(const DeviceModel& device, const glm::dquat& R) {
  const std::string_view x = direction(R * glm::dvec3(1, 0, 0)), y = direction(R * glm::dvec3(0, 1, 0)),
                         z = direction(R * glm::dvec3(0, 0, 1));
  if (!x.empty() && !y.empty() && !z.empty()) {
    return fmt::format("Right on the {} is {} in the view, away is {}, up is {}.", device.title, x, y, z);
  }
  const glm::dvec3 turn = spatial::vector_from_rotation(R);
  const double angle = glm::length(turn);
  return fmt::format("The {} is turned against the view by {:.0f} degrees about ({:.2g}, {:.2g}, {:.2g}).",
                     device.title, angle * kDegrees, turn.x / angle, turn.y / angle, turn.z / angle);
}

std::string speed_in_words(const DeviceModel& device, const HandSettings& settings) {
  const double full_m_s = settings.rate_speed_m_s > 0 ? settings.rate_speed_m_s : device.full_speed_m_s;
  const double full_rad_s =
      device.full_rotation_rad_s * (device.full_speed_m_s > 0 ? full_m_s / device.full_speed_m_s : 1);
  const std::string move = fmt::format("{:.0f} mm/s", 1e3 * full_m_s),
                    turn = fmt::format("{:.0f} degrees/s", kDegrees * full_rad_s);
  const std::string half = fmt::format("half the way is {:.0f} % of it", 100 * shaped(0.5));
  switch (settings.axes) {
    case Axes::kTranslation:
      return fmt::format("Pushed all the way it moves the tool at {}; {}. It does not turn it.", move, half);
    case Axes::kRotation:
      return fmt::format("Turned all the way it turns the tool at {}; {}. It does not move it.", turn, half);
    case Axes::kDominant:
      return fmt::format(
          "Pushed all the way it moves the tool at {}, turned at {}; {}. Only the axis that is "
          "deflected most counts.",
          move, turn, half);
    case Axes::kAll:
      break;
  }
  return fmt::format("Pushed all the way it moves the tool at {}, turned at {}; {}.", move, turn, half);
}

std::string clutch_in_words(const DeviceModel& device, bool is_rate) {
  const std::string what = is_rate ? "the tool stays, whatever is deflected" : "the handle moves and the tool stays";
  return device.clutch_button >= 0 ? fmt::format("Clutch: while button {} is held {}.", device.clutch_button + 1, what)
                                   : fmt::format(
                                         "Clutch: this device has no button for it; while the key for it is "
                                         "held at the station {}.",
                                         what);
}

std::string turning_in_words(const DeviceModel& primary, const DeviceModel* second, const HandSettings& settings) {
  switch (settings.orientation) {
    case OrientationFrom::kOwn:
      return primary.rotation_dof == 3 || primary.tells == Tells::kRate ? "Turning: by the handle itself."
                                                                        : "Turning: nothing turns the tool.";
    case OrientationFrom::kSecond: {
      if (!second) break;
      std::string text = fmt::format("Turning: the {}", second->title);
      if (second->tells == Tells::kRate) {
        text += fmt::format(", turned all the way at {:.0f} degrees/s", kDegrees * second->full_rotation_rad_s);
        if (second->clutch_button >= 0)
          text += fmt::format("; not while its button {} is held", second->clutch_button + 1);
      }
      return text + ".";
    }
    case OrientationFrom::kTwist:
      return fmt::format(
          "Turning: while button {} is held, moving the handle turns the tool and does not move it, {:.0f} degrees for "
          "100 mm: to the right turns it round, up turns its front up, away turns it clockwise. The tool's torque is "
          "then felt as a force.",
          settings.twist_button + 1, 0.1 * Hand::kTwist_rad_per_m * kDegrees);
    case OrientationFrom::kFixed:
      break;
  }
  return "Turning: nothing turns the tool.";
}

}  // namespace

std::vector<std::string> mapping_in_words(const DeviceModel& primary, const DeviceModel* second,
                                          const DeviceModel* view, const HandSettings& settings,
                                          const master_station::GearScales& scales) {
  const bool is_rate = primary.tells == Tells::kRate;
  std::vector<std::string> lines{axes_in_words(primary, settings.R_BP)};
  if (is_rate) {
    lines.push_back(speed_in_words(primary, settings));
    lines.push_back(
        fmt::format("It stays within {:.0f} mm of where it starts, along each axis.", 1e3 * settings.reach_m));
  } else {
    std::string scale = fmt::format("1 mm of the handle is {:.3g} mm of the tool", scales.workspace);
    if (primary.force_dof > 0) scale += fmt::format(", and 1 N at the tool is {:.3g} N in the hand", scales.force);
    lines.push_back(scale + ".");
    lines.emplace_back("The tool starts where the scene has it, wherever the handle is held.");
  }
  lines.push_back(turning_in_words(primary, second, settings));
  if (second && settings.orientation == OrientationFrom::kSecond &&
      direction(settings.R_BSecond * glm::dvec3(0, 0, 1)) != "up")
    lines.push_back(axes_in_words(*second, settings.R_BSecond));
  if (scales.has_clutch || is_rate) lines.push_back(clutch_in_words(primary, is_rate));
  if (view)
    lines.push_back(
        fmt::format("View: turning the {} about its upright axis turns the view, and with it what is right and away.",
                    view->title));
  if (primary.force_dof == 0) {
    lines.push_back(fmt::format("Nothing is felt: the {} has no force.{}", primary.title,
                                is_rate ? fmt::format(" The tool presses with {:g} N at most.", Hand::kYield_N) : ""));
  } else if (primary.torque_dof == 0) {
    lines.push_back(fmt::format("The {} has no torque: what the tool is turned with is not felt, and told as masked.",
                                primary.title));
  }
  return lines;
}

}  // namespace farfeel::devices
