#include "slave_sim/bake/assembly.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <set>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::slave_sim {
namespace {

/// As it is, or with a number behind it.
std::string unlike(const std::string& name, std::set<std::string>& taken) {
  std::string other = name;
  for (int n = 2; !taken.insert(other).second; ++n) other = fmt::format("{}-{}", name, n);
  return other;
}

/// Of letters and the like that no file system and no shell minds.
std::string plain(const std::string& name) {
  constexpr std::size_t kLongest = 60;
  std::string out = name.substr(0, kLongest);
  std::replace_if(
      out.begin(), out.end(), [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '_' && c != '.'; },
      '_');
  const std::size_t first = out.find_first_not_of('.');
  return first == std::string::npos ? "part" : out.substr(first);
}

/// Between quotes, as TOML has it, which is as JSON has it but for one character; bytes that are no UTF-8 are replaced.
std::string quoted(std::string text) {
  constexpr char kDelete = 0x7F;
  std::erase(text, kDelete);
  return nlohmann::json(std::move(text)).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

std::vector<std::string> asset_names(const codecs::MeshParts& parts) {
  std::vector<std::string> names(parts.shapes.size());
  std::set<std::string> taken;
  for (const codecs::MeshPart& part : parts.parts) {
    if (names[part.shape].empty()) names[part.shape] = unlike(plain(part.name), taken) + ".glb";
  }
  return names;
}

std::string scene_of_parts(const codecs::MeshParts& parts, const std::vector<std::string>& asset_names,
                           const std::string& title, double metres_per_unit) {
  std::string toml = fmt::format(
      "# Every part stands where the assembly's file had it. Put another [tool] here: model = \"...\" or asset = "
      "\"....glb\"\ntitle = {}\ntolerance_m = 0.003\n\n[tool]\nmodel = \"probe\"\n",
      quoted(title));
  std::set<std::string> taken;
  for (const codecs::MeshPart& part : parts.parts) {
    const glm::dvec3 p_m = metres_per_unit * part.p;
    const glm::dvec3 turn_deg = glm::degrees(spatial::vector_from_rotation(part.R));
    toml += fmt::format("\n[[object]]\nname = {}\nasset = {}\nposition_m = [{:.9g}, {:.9g}, {:.9g}]\n",
                        quoted(unlike(part.name.empty() ? "part" : part.name, taken)), quoted(asset_names[part.shape]),
                        p_m.x, p_m.y, p_m.z);
    if (glm::length(turn_deg) > 0)
      toml += fmt::format("rotation_vector_deg = [{:.9g}, {:.9g}, {:.9g}]\n", turn_deg.x, turn_deg.y, turn_deg.z);
  }
  return toml;
}

}  // namespace farfeel::slave_sim
