// Which device does what: what a person asked for, and what that means with the devices at hand.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "master_station/devices/hand/hand.h"

namespace farfeel::devices {

struct ChoiceError {
  std::string message;  ///< what was asked for, what was wrong, what is possible
};

/// A model's name, or the first words of it ("spacemouse" is any SpaceMouse), and a serial number; empty: any.
struct DeviceName {
  std::string name, serial;
  [[nodiscard]] bool fits(std::string_view model, std::string_view serial_number) const noexcept;
  [[nodiscard]] std::string text() const;  ///< as it was typed
};

/// What was typed; empty: not given.
struct ChoiceWords {
  std::vector<std::string> device{};  ///< --device auto|simulated|NAME[:SERIAL], several at once
  std::string orientation{};          ///< --orientation NAME[:SERIAL]|twist[:BUTTON]|fixed; buttons count from 1
  std::string view{};                 ///< --view NAME[:SERIAL]: a rate input
  std::string axes{};                 ///< --axes all|translation|rotation|dominant
  std::string rate_speed{};           ///< --rate-speed, m/s of the tool at full deflection
};

struct HandChoice {
  bool is_auto = true, is_simulated = false;  ///< else the devices that are named
  std::vector<DeviceName> devices;
  std::optional<OrientationFrom> orientation;  ///< kSecond, kTwist or kFixed; nothing: what the devices can best do
  std::optional<DeviceName> orientation_device, view_device;
  std::optional<int> twist_button;  ///< from 0
  Axes axes = Axes::kAll;
  double rate_speed_m_s = 0;  ///< 0: as the model says
};

/// names: of all models that this program knows.
[[nodiscard]] tl::expected<HandChoice, ChoiceError> parse_choice(const ChoiceWords&,
                                                                 std::span<const std::string_view> names);

/// A device that can be opened.
struct Candidate {
  const DeviceModel* model;  ///< not null
  std::string serial;
};

/// Places in the span of candidates.
struct HandRoles {
  std::optional<std::size_t> primary, second, view;  ///< no primary: the simulated device
  OrientationFrom orientation = OrientationFrom::kFixed;
  int twist_button = 0;
  std::string told;  ///< one sentence for the person: what was taken, and why
};

/// auto takes a device with force before a rate input, and lets a rate input turn the tool of a device that tells no
/// orientation. With nothing plugged in it is the simulated device, and told says so. A device has one role.
[[nodiscard]] tl::expected<HandRoles, ChoiceError> assign_roles(const HandChoice&, std::span<const Candidate>);

/// What both say of a hand's settings; capabilities, start and scale are left to be filled in.
[[nodiscard]] HandSettings settings_from(const HandChoice&, const HandRoles&);

}  // namespace farfeel::devices
