#include "codecs/device/inverse3.h"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstring>

#include "codecs/device/json_reader.h"

namespace farfeel::codecs {
namespace {

// An arm of 0.3 m does not reach or move beyond these.
constexpr double kFar_m = 2;
constexpr double kFast_m_s = 50;
// The service prints some 8 digits of 16-bit components.
constexpr double kOrientationSlack = 0.02;

bool read_id(JsonReader& json, Inverse3Id& id) noexcept {
  const std::string_view text = json.string();
  id = {};
  const bool is_plain = std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '-' || c == '_';
  });
  if (!is_plain || text.size() > id.bytes.size()) return false;
  std::copy(text.begin(), text.end(), id.bytes.begin());
  id.size = text.size();
  return id.size > 0;
}

/// Numbers by name; true: all of them were there. Null, as of a device that has nothing yet, is none of them.
template <std::size_t kCount>
bool read_numbers(JsonReader& json, const std::array<std::string_view, kCount>& names,
                  std::array<double, kCount>& values) noexcept {
  unsigned seen = 0;
  if (json.peek() != '{') {
    json.skip();
    return false;
  }
  json.object([&](std::string_view key) {
    const auto name = std::find(names.begin(), names.end(), key);
    if (name == names.end()) return json.skip();
    const auto i = static_cast<std::size_t>(name - names.begin());
    values[i] = json.number();
    seen |= 1U << i;
  });
  return json.is_good() && seen == (1U << kCount) - 1;
}

bool read_vector(JsonReader& json, glm::dvec3& v, double most) noexcept {
  std::array<double, 3> values{};
  const bool is_whole = read_numbers<3>(json, {"x", "y", "z"}, values);
  v = {values[0], values[1], values[2]};
  return is_whole && std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) <= most;
}

bool read_quaternion(JsonReader& json, glm::dquat& q) noexcept {
  std::array<double, 4> values{};
  const bool is_whole = read_numbers<4>(json, {"w", "x", "y", "z"}, values);
  const double length =
      std::sqrt(values[0] * values[0] + values[1] * values[1] + values[2] * values[2] + values[3] * values[3]);
  if (!is_whole || !(std::abs(length - 1) <= kOrientationSlack)) {
    q = glm::dquat(1, 0, 0, 0);
    return false;
  }
  q = glm::dquat(values[0] / length, values[1] / length, values[2] / length, values[3] / length);
  return true;
}

/// An object whose members are read by on_key; anything else is skipped.
template <typename OnKey>
void members(JsonReader& json, OnKey&& on_key) noexcept {
  if (json.peek() != '{') return json.skip();
  json.object(on_key);
}

// Members that come twice count as they came last, as most readers of JSON have it.
bool read_arm(JsonReader& json, Inverse3State& arm) noexcept {
  bool has_id = false;
  arm = {};
  members(json, [&](std::string_view key) {
    if (key == "device_id" && json.peek() == '"') {
      has_id = read_id(json, arm.id);
    } else if (key == "state") {
      arm.has_position = arm.has_velocity = false;
      members(json, [&](std::string_view name) {
        if (name == "cursor_position") {
          arm.has_position = read_vector(json, arm.position_m, kFar_m);
        } else if (name == "cursor_velocity") {
          arm.has_velocity = read_vector(json, arm.velocity_m_s, kFast_m_s);
        } else {
          json.skip();
        }
      });
    } else if (key == "status") {
      arm.is_calibrated = arm.is_ready = arm.has_power = true;
      members(json, [&](std::string_view name) {
        bool* const is = name == "calibrated"     ? &arm.is_calibrated
                         : name == "ready"        ? &arm.is_ready
                         : name == "power_supply" ? &arm.has_power
                                                  : nullptr;
        if (is == nullptr || (json.peek() != 't' && json.peek() != 'f')) return json.skip();
        *is = json.boolean();
      });
    } else if (key == "config") {
      arm.has_other_basis = false;
      members(json, [&](std::string_view name) {
        if (name != "basis") return json.skip();
        arm.has_other_basis = false;
        members(json, [&](std::string_view inner) {
          if (inner != "permutation" || json.peek() != '"') return json.skip();
          arm.has_other_basis = json.string() != "XYZ";
        });
      });
    } else {
      json.skip();
    }
  });
  if (!arm.has_position) arm.position_m = glm::dvec3(0);
  if (!arm.has_velocity) arm.velocity_m_s = glm::dvec3(0);
  return has_id;
}

bool read_grip(JsonReader& json, VerseGripState& grip) noexcept {
  bool has_id = false;
  grip = {};
  const auto press = [&](std::uint32_t bit, bool is_down) {
    grip.buttons = is_down ? grip.buttons | bit : grip.buttons & ~bit;
  };
  members(json, [&](std::string_view key) {
    if (key == "device_id" && json.peek() == '"') {
      has_id = read_id(json, grip.id);
    } else if (key == "state") {
      grip.has_orientation = false;
      grip.buttons = 0;
      members(json, [&](std::string_view name) {
        if (name == "orientation") {
          grip.has_orientation = read_quaternion(json, grip.orientation);
        } else if (name == "button" && (json.peek() == 't' || json.peek() == 'f')) {
          press(1, json.boolean());
        } else if (name == "buttons") {
          grip.buttons = 0;
          members(json, [&](std::string_view button) {
            const bool is_known = button == "a" || button == "b" || button == "c";
            if (!is_known || (json.peek() != 't' && json.peek() != 'f')) return json.skip();
            press(1U << (button[0] - 'a'), json.boolean());
          });
        } else {
          json.skip();
        }
      });
    } else {
      json.skip();
    }
  });
  if (!grip.has_orientation) grip.orientation = glm::dquat(1, 0, 0, 0);
  return has_id;
}

/// Devices of an array; those that read() does not like, or for which there is no room, are left out.
template <typename Device, std::size_t kMax, typename Read>
void read_devices(JsonReader& json, std::array<Device, kMax>& devices, std::size_t& count, Read&& read) noexcept {
  count = 0;
  if (json.peek() != '[') return json.skip();
  json.array([&](std::size_t) {
    if (count == kMax) return json.skip();
    if (read(json, devices[count])) ++count;
  });
}

}  // namespace

const Inverse3State* Inverse3Update::arm(std::string_view id) const noexcept {
  const auto* const end = arms.begin() + arm_count;
  const auto* const found =
      std::find_if(arms.begin(), end, [&](const Inverse3State& is) { return is.id.text() == id; });
  return found != end ? found : nullptr;
}

std::optional<Inverse3Update> decode_inverse3(std::string_view text) noexcept {
  Inverse3Update update;
  std::array<VerseGripState, kInverse3DevicesMax> wired;
  std::size_t wired_count = 0;
  JsonReader json(text);
  json.object([&](std::string_view key) {
    if (key == "inverse3") {
      read_devices(json, update.arms, update.arm_count, read_arm);
    } else if (key == "wireless_verse_grip") {
      read_devices(json, update.grips, update.grip_count, read_grip);
    } else if (key == "verse_grip") {
      read_devices(json, wired, wired_count, read_grip);
    } else {
      json.skip();
    }
  });
  json.end();
  if (!json.is_good()) return std::nullopt;
  for (std::size_t i = 0; i < wired_count && update.grip_count < kInverse3DevicesMax; ++i)
    update.grips[update.grip_count++] = wired[i];
  return update;
}

std::size_t encode_inverse3_force(std::span<char, kInverse3CommandMax> text, std::string_view id,
                                  const glm::dvec3& force_N) noexcept {
  assert(id.size() <= kInverse3IdMax);
  char* at = text.data();
  const auto put = [&](std::string_view part) { at = std::copy(part.begin(), part.end(), at); };
  // Without an exponent, in micronewtons' steps: at most "-100.000000".
  const auto put_number = [&](double value) {
    if (value == 0) return put("0");  // short, so that zero force fits what a keeper holds
    const double within = std::isfinite(value) ? std::clamp(value, -100.0, 100.0) : 0.0;
    at = std::to_chars(at, text.data() + text.size(), within, std::chars_format::fixed, 6).ptr;
  };
  put(R"({"inverse3":[{"device_id":")");
  put(id.substr(0, kInverse3IdMax));
  put(R"(","commands":{"set_cursor_force":{"values":{"x":)");
  put_number(force_N.x);
  put(R"(,"y":)");
  put_number(force_N.y);
  put(R"(,"z":)");
  put_number(force_N.z);
  put("}}}}]}");
  return static_cast<std::size_t>(at - text.data());
}

std::size_t encode_text_frame(std::span<std::byte> frame, std::string_view text) noexcept {
  constexpr std::byte kFinalText{0x81};
  constexpr unsigned kMasked = 0x80, kTwoBytesFollow = 126;
  constexpr std::size_t kMask = 4, kMostInOneByte = 125, kMostInTwo = 65535;
  const std::size_t head = text.size() <= kMostInOneByte ? 2 : 4;
  if (text.size() > kMostInTwo || head + kMask + text.size() > frame.size()) return 0;
  frame[0] = kFinalText;
  if (head == 2) {
    frame[1] = static_cast<std::byte>(kMasked | text.size());
  } else {
    frame[1] = static_cast<std::byte>(kMasked | kTwoBytesFollow);
    frame[2] = static_cast<std::byte>(text.size() >> 8);
    frame[3] = static_cast<std::byte>(text.size() & 0xFF);
  }
  std::memset(frame.data() + head, 0, kMask);
  std::memcpy(frame.data() + head + kMask, text.data(), text.size());
  return head + kMask + text.size();
}

}  // namespace farfeel::codecs
