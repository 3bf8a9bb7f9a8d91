#include "tests/bench/felt_bytes.h"

#include <nlohmann/json.hpp>

#include "codecs/mesh/glb.h"

namespace farfeel::bench {

std::size_t felt_bytes(std::span<const std::byte> asset) {
  const auto glb = codecs::split_glb(asset);
  if (!glb) return 0;
  const nlohmann::json& surface = glb->json["extensions"]["FARFEEL_haptic_surface"];
  const nlohmann::json& view = glb->json["bufferViews"][surface["felt_view"].get<std::size_t>()];
  return surface.dump().size() + view.dump().size() + view["byteLength"].get<std::size_t>();
}

}  // namespace farfeel::bench
