#include "master_station/devices/hand/hand_choice.h"

#include <fmt/format.h>

#include <array>
#include <charconv>

#include "codecs/text/nearest_word.h"

namespace farfeel::devices {
namespace {

constexpr std::string_view kAuto = "auto", kSimulated = "simulated", kTwistWord = "twist", kFixedWord = "fixed";
constexpr std::array<std::string_view, 4> kAxesWords{"all", "translation", "rotation", "dominant"};
constexpr int kMostButtons = 32;  // a sample's
/// Slower is not seen to move; faster leaves a hand's workspace between two thoughts.
constexpr double kSlowest_m_s = 1e-3, kFastest_m_s = 1;

using Failure = tl::unexpected<ChoiceError>;

template <class... Arguments>
Failure fail(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  return Failure({fmt::format(text, std::forward<Arguments>(arguments)...)});
}

std::string did_you_mean(std::string_view word, std::span<const std::string_view> candidates) {
  const std::string_view near = codecs::nearest_word(word, candidates);
  return near.empty() ? fmt::format("; possible are {}", fmt::join(candidates, ", "))
                      : fmt::format("; did you mean {}?", near);
}

DeviceName split(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return {std::string(text), ""};
  return {std::string(text.substr(0, colon)), std::string(text.substr(colon + 1))};
}

/// words: what else the option takes, for the nearest word.
tl::expected<DeviceName, ChoiceError> device_name(std::string_view option, std::string_view text,
                                                  std::span<const std::string_view> names,
                                                  std::span<const std::string_view> words) {
  DeviceName device = split(text);
  if (text.find(':') != std::string_view::npos && device.serial.empty())
    return fail("{} {}: a serial number is missing after the colon", option, text);
  for (const std::string_view name : names) {
    if (DeviceName{device.name, ""}.fits(name, "")) return device;
  }
  std::vector<std::string_view> all(words.begin(), words.end());
  all.insert(all.end(), names.begin(), names.end());
  return fail("{} {}: no device is known by that name{}", option, text, did_you_mean(device.name, all));
}

/// All of the text; nothing: it is not such a number.
template <class Number>
std::optional<Number> number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

bool can_turn(const DeviceModel& model) {
  return model.tells == Tells::kRate || model.rotation_dof == 3;
}

std::string title(const Candidate& candidate) {
  return candidate.serial.empty() ? candidate.model->title
                                  : fmt::format("{} {}", candidate.model->title, candidate.serial);
}

std::string plugged_in(std::span<const Candidate> candidates) {
  if (candidates.empty()) return "no device is plugged in that can be opened";
  std::vector<std::string> names;
  for (const Candidate& c : candidates) {
    names.push_back(c.serial.empty() ? c.model->name : c.model->name + ":" + c.serial);
  }
  return fmt::format("plugged in: {}", fmt::join(names, ", "));
}

/// Gives out the candidates, each once.
class Pool {
 public:
  explicit Pool(std::span<const Candidate> candidates) : candidates_(candidates), is_taken_(candidates.size()) {}

  tl::expected<std::size_t, ChoiceError> take(std::string_view option, const DeviceName& name) {
    bool is_there = false;
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      if (!name.fits(candidates_[i].model->name, candidates_[i].serial)) continue;
      if (!is_taken_[i]) return take(i);
      is_there = true;
    }
    if (is_there) return fail("{} {}: it has another role already, and there is no second one", option, name.text());
    return fail("{} {}: it is not plugged in, or cannot be opened; {}", option, name.text(), plugged_in(candidates_));
  }
  template <class Wanted>
  std::optional<std::size_t> take_first(Wanted&& wanted) {
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      if (!is_taken_[i] && wanted(*candidates_[i].model)) return take(i);
    }
    return std::nullopt;
  }

 private:
  std::size_t take(std::size_t i) {
    is_taken_[i] = true;
    return i;
  }
  std::span<const Candidate> candidates_;
  std::vector<bool> is_taken_;
};

std::string told(const HandRoles& roles, const HandChoice& choice, std::span<const Candidate> candidates) {
  if (!roles.primary) {
    return choice.is_simulated
               ? "The simulated device and a simulated hand: as asked for."
               : "The simulated device and a simulated hand: no device is plugged in that can be opened. farfeel "
                 "doctor says why, if one is.";
  }
  std::string text = fmt::format("The hand is at the {}", title(candidates[*roles.primary]));
  if (choice.is_auto) {
    text += candidates[*roles.primary].model->force_dof > 0 ? ", which has force"
            : candidates[*roles.primary].model->tells == Tells::kRate
                ? ", a rate input: nothing with force is plugged in, so nothing is felt"
                : ": nothing with force is plugged in, so nothing is felt";
  }
  if (roles.second) text += fmt::format("; the {} turns the tool", title(candidates[*roles.second]));
  if (roles.view) text += fmt::format("; the {} turns the view", title(candidates[*roles.view]));
  return text + ".";
}

}  // namespace

bool DeviceName::fits(std::string_view model, std::string_view serial_number) const noexcept {
  const bool is_named = model == name || (!name.empty() && model.size() > name.size() && model.starts_with(name) &&
                                          model[name.size()] == '-');
  return is_named && (serial.empty() || serial == serial_number);
}

std::string DeviceName::text() const {
  return serial.empty() ? name : name + ":" + serial;
}

tl::expected<HandChoice, ChoiceError> parse_choice(const ChoiceWords& words, std::span<const std::string_view> names) {
  HandChoice choice;
  for (const std::string& text : words.device) {
    if (text == kAuto || text == kSimulated) {
      if (words.device.size() > 1) return fail("--device {}: nothing else can be named beside it", text);
      choice.is_auto = text == kAuto;
      choice.is_simulated = text == kSimulated;
      continue;
    }
    const auto device = device_name("--device", text, names, std::array{kAuto, kSimulated});
    if (!device) return tl::unexpected(device.error());
    choice.is_auto = false;
    choice.devices.push_back(*device);
  }
  if (const DeviceName word = split(words.orientation); words.orientation == kFixedWord) {
    choice.orientation = OrientationFrom::kFixed;
  } else if (word.name == kTwistWord) {
    choice.orientation = OrientationFrom::kTwist;
    if (words.orientation != kTwistWord) {
      const std::optional<int> button = number<int>(word.serial);
      if (!button || *button < 1 || *button > kMostButtons)
        return fail("--orientation {}: the button is a number from 1 to {}", words.orientation, kMostButtons);
      choice.twist_button = *button - 1;
    }
  } else if (!words.orientation.empty()) {
    const auto device = device_name("--orientation", words.orientation, names, std::array{kTwistWord, kFixedWord});
    if (!device) return tl::unexpected(device.error());
    choice.orientation = OrientationFrom::kSecond;
    choice.orientation_device = *device;
  }
  if (!words.view.empty()) {
    const auto device = device_name("--view", words.view, names, {});
    if (!device) return tl::unexpected(device.error());
    choice.view_device = *device;
  }
  if (!words.axes.empty()) {
    std::size_t i = 0;
    while (i < kAxesWords.size() && kAxesWords[i] != words.axes) ++i;
    if (i == kAxesWords.size()) return fail("--axes {}: not known{}", words.axes, did_you_mean(words.axes, kAxesWords));
    choice.axes = static_cast<Axes>(i);
  }
  if (!words.rate_speed.empty()) {
    const std::optional<double> speed = number<double>(words.rate_speed);
    if (!speed || !(*speed >= kSlowest_m_s && *speed <= kFastest_m_s))
      return fail("--rate-speed {}: it is the tool's speed at full deflection, from {:g} to {:g} m/s", words.rate_speed,
                  kSlowest_m_s, kFastest_m_s);
    choice.rate_speed_m_s = *speed;
  }
  return choice;
}

tl::expected<HandRoles, ChoiceError> assign_roles(const HandChoice& choice, std::span<const Candidate> candidates) {
  HandRoles roles;
  Pool pool(candidates);
  // What is named for a role first, so that auto does not take it for another.
  if (choice.view_device) {
    const auto i = pool.take("--view", *choice.view_device);
    if (!i) return tl::unexpected(i.error());
    if (candidates[*i].model->tells != Tells::kRate)
      return fail("--view {}: only a rate input turns the view", choice.view_device->text());
    roles.view = *i;
  }
  if (choice.orientation_device) {
    const auto i = pool.take("--orientation", *choice.orientation_device);
    if (!i) return tl::unexpected(i.error());
    if (!can_turn(*candidates[*i].model))
      return fail("--orientation {}: it tells no orientation", choice.orientation_device->text());
    roles.second = *i;
  }
  std::vector<std::size_t> named;
  for (const DeviceName& device : choice.devices) {
    const auto i = pool.take("--device", device);
    if (!i) return tl::unexpected(i.error());
    // The first, but one that tells a pose before a rate input.
    const bool is_first = !named.empty() && candidates[*i].model->tells == Tells::kPose &&
                          candidates[named.front()].model->tells == Tells::kRate;
    named.insert(is_first ? named.begin() : named.end(), *i);
  }
  if (!named.empty()) roles.primary = named.front();
  if (named.size() == 2 && !choice.orientation && can_turn(*candidates[named[1]].model)) {
    roles.second = named[1];
  } else if (named.size() > 1) {
    return fail("--device {}: one device is for the hand; name what another is for by --orientation or --view",
                candidates[named[1]].model->name);
  }
  if (choice.is_auto) {
    roles.primary = pool.take_first([](const DeviceModel& m) { return m.force_dof > 0; });
    if (!roles.primary) roles.primary = pool.take_first([](const DeviceModel& m) { return m.tells == Tells::kRate; });
    if (!roles.primary) roles.primary = pool.take_first([](const DeviceModel&) { return true; });
    const bool is_pose_alone = roles.primary && !can_turn(*candidates[*roles.primary].model);
    if (is_pose_alone && !choice.orientation)
      roles.second = pool.take_first([](const DeviceModel& m) { return m.tells == Tells::kRate; });
  }
  roles.told = told(roles, choice, candidates);
  if (!roles.primary) {
    if (roles.second || roles.view)
      return fail("--orientation and --view need a device for the hand; {}", plugged_in(candidates));
    return roles;
  }
  const DeviceModel& primary = *candidates[*roles.primary].model;
  roles.orientation = choice.orientation.value_or(default_orientation(primary, roles.second.has_value()));
  if (roles.orientation == OrientationFrom::kTwist && primary.tells == Tells::kRate)
    return fail("--orientation twist: the {} is a rate input, which turns the tool by itself", primary.title);
  roles.twist_button = choice.twist_button.value_or(default_twist_button(primary));
  if (roles.orientation == OrientationFrom::kTwist &&
      (roles.twist_button == primary.enable_button || roles.twist_button == primary.clutch_button))
    return fail("--orientation twist:{}: this button of the {} has another use", roles.twist_button + 1, primary.title);
  return roles;
}

HandSettings settings_from(const HandChoice& choice, const HandRoles& roles) {
  HandSettings settings;
  settings.orientation = roles.orientation;
  settings.twist_button = roles.twist_button;
  settings.axes = choice.axes;
  settings.rate_speed_m_s = choice.rate_speed_m_s;
  return settings;
}

}  // namespace farfeel::devices
