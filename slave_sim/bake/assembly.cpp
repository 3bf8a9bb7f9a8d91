#include "slave_sim/bake/assembly.h"

#include <fmt/format.h>

#include <set>

#include "codecs/text/plain_names.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::slave_sim {

using codecs::plain_name;
using codecs::quoted_for_toml;
using codecs::unlike;

std::vector<std::string> asset_names(const codecs::MeshParts& parts) {
  std::vector<std::string> names(parts.shapes.size());
  std::set<std::string> taken;
  for (const codecs::MeshPart& part : parts.parts) {
    if (names[part.shape].empty()) names[part.shape] = unlike(plain_name(part.name, "part"), taken) + ".glb";
  }
  return names;
}

std::string scene_of_parts(const codecs::MeshParts& parts, const std::vector<std::string>& asset_names,
                           const std::string& title, double metres_per_unit) {
  std::string toml = fmt::format(
      "# Every part stands where the assembly's file had it. Put another [tool] here: model = \"...\" or asset = "
      "\"....glb\"\ntitle = {}\ntolerance_m = 0.003\n\n[tool]\nmodel = \"probe\"\n",
      quoted_for_toml(title));
  std::set<std::string> taken;
  for (const codecs::MeshPart& part : parts.parts) {
    const glm::dvec3 p_m = metres_per_unit * part.p;
    const glm::dvec3 turn_deg = glm::degrees(spatial::vector_from_rotation(part.R));
    toml += fmt::format("\n[[object]]\nname = {}\nasset = {}\nposition_m = [{:.9g}, {:.9g}, {:.9g}]\n",
                        quoted_for_toml(unlike(part.name.empty() ? "part" : part.name, taken)),
                        quoted_for_toml(asset_names[part.shape]), p_m.x, p_m.y, p_m.z);
    if (glm::length(turn_deg) > 0)
      toml += fmt::format("rotation_vector_deg = [{:.9g}, {:.9g}, {:.9g}]\n", turn_deg.x, turn_deg.y, turn_deg.z);
  }
  return toml;
}

}  // namespace farfeel::slave_sim
