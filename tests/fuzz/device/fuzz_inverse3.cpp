// Any bytes as what the Inverse3's service says. What is accepted is JSON, by another reader's word, and its values are
// that reader's; all of them are finite and within what an arm can do.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string_view>

#include "codecs/device/inverse3.h"

using namespace farfeel::codecs;
using nlohmann::json;

namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

bool is_same(const json& vector, const glm::dvec3& v) {
  return vector.at("x").get<double>() == v.x && vector.at("y").get<double>() == v.y &&
         vector.at("z").get<double>() == v.z;
}

/// Is there a device in the array that this one was read of?
bool has_arm(const json& arms, const Inverse3State& arm) {
  return std::any_of(arms.begin(), arms.end(), [&](const json& is) {
    if (!is.is_object() || !is.contains("device_id") || is["device_id"] != std::string(arm.id.text())) return false;
    if (arm.has_position && !is_same(is.at("state").at("cursor_position"), arm.position_m)) return false;
    return !arm.has_velocity || is_same(is.at("state").at("cursor_velocity"), arm.velocity_m_s);
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  const auto update = decode_inverse3(text);
  if (!update) return 0;
  demand(update->arm_count <= kInverse3DevicesMax && update->grip_count <= kInverse3DevicesMax);
  for (std::size_t i = 0; i < update->arm_count; ++i) {
    const Inverse3State& arm = update->arms[i];
    demand(arm.id.size > 0 && arm.id.size <= kInverse3IdMax);
    for (int axis = 0; axis < 3; ++axis)
      demand(std::abs(arm.position_m[axis]) <= 2 && std::abs(arm.velocity_m_s[axis]) <= 50);
  }
  for (std::size_t i = 0; i < update->grip_count; ++i)
    demand(std::abs(glm::length(update->grips[i].orientation) - 1) < 1e-9);

  // The other reader resolves escapes and looks at UTF-8, which ours need not.
  if (std::any_of(bytes, bytes + size, [](std::uint8_t byte) { return byte >= 0x80 || byte == '\\'; })) return 0;
  const json other = json::parse(text, nullptr, false);
  demand(other.is_object());
  for (std::size_t i = 0; i < update->arm_count; ++i) demand(has_arm(other.at("inverse3"), update->arms[i]));
  if (!other.contains("inverse3")) demand(update->arm_count == 0);
  return 0;
}
