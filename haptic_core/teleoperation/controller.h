// Who renders the force: our local model, or one of the field's ways to send it across the line, to compare with.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::teleoperation {

enum class Controller : std::uint8_t {
  kOurs,       ///< the local model
  kDirect,     ///< the remote's wrench straight to the hand
  kWaves,      ///< wave variables to a tool at the remote
  kPassivity,  ///< time-domain passivity: velocity goes, force comes, each end dissipates what it may not give
};
inline constexpr std::array kControllers{Controller::kOurs, Controller::kDirect, Controller::kWaves,
                                         Controller::kPassivity};

/// As on a command line.
[[nodiscard]] constexpr std::string_view name(Controller controller) {
  switch (controller) {
    case Controller::kOurs:
      return "ours";
    case Controller::kDirect:
      return "direct";
    case Controller::kWaves:
      return "waves";
    case Controller::kPassivity:
      return "passivity";
  }
  return "unknown";
}
[[nodiscard]] constexpr std::optional<Controller> find_controller(std::string_view wanted) {
  for (const Controller c : kControllers)
    if (name(c) == wanted) return c;
  return std::nullopt;
}
[[nodiscard]] inline std::vector<std::string> controller_names() {
  std::vector<std::string> names;
  for (const Controller c : kControllers) names.emplace_back(name(c));
  return names;
}

/// What travels the line, either way: a velocity, a wave, or a wrench, about To in W, and, for waves and
/// time-domain passivity, all the energy that the sender has put in so far: cumulative, so that a lost message only
/// under-credits.
struct LineValue {
  spatial::Vector6 value = spatial::Vector6::Zero();
  double energy_in_J = 0;
  /// On the way to the remote: what is made of it there. kWaves and kPassivity move a tool that the remote simulates.
  Controller by = Controller::kOurs;

  [[nodiscard]] bool moves_remote_tool() const { return by == Controller::kWaves || by == Controller::kPassivity; }
};

// Of the line: both ends must have the same.
inline constexpr double kLineImpedance_Ns_per_m = 5, kLineImpedance_Nms_per_rad = 0.005;
inline constexpr double kMostDamping_Ns_per_m = 10;  ///< of the passivity controller at the handle
inline constexpr double kDampingArm_m = 0.0316;      ///< a rotation counts as the way at this arm

}  // namespace farfeel::teleoperation
