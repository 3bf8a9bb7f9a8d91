#include "tests/bench/felt_bytes.h"

#include <nlohmann/json.hpp>

#include "codecs/asset/felt_stream.h"
#include "codecs/mesh/glb.h"

namespace farfeel::bench {

std::size_t felt_bytes(std::span<const std::byte> asset) {
  const auto glb = codecs::split_glb(asset);
  if (!glb) return 0;
  const nlohmann::json& surface = glb->json["extensions"]["FARFEEL_haptic_surface"];
  const nlohmann::json& view = glb->json["bufferViews"][surface["felt_view"].get<std::size_t>()];
  return surface.dump().size() + view.dump().size() + view["byteLength"].get<std::size_t>();
}

FeltParts felt_parts(const codecs::Asset& asset) {
  const geometry::TriangleMesh tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                           {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
  geometry::HapticSurface felt = asset.felt;
  const std::size_t all = codecs::encoded_felt(felt, asset.detail.mesh).size();
  const std::size_t without_heights =
      codecs::encoded_felt(felt, tetrahedron).size();  // they follow from next to nothing
  for (std::uint32_t& piece : felt.triangle_piece) piece = 0;
  for (std::uint32_t& chart : felt.triangle_chart) chart = 0;
  felt.piece_count = 1;
  felt.piece_thickness_m.resize(1);
  const std::size_t coarse = codecs::encoded_felt(felt, tetrahedron).size();
  return {coarse, without_heights - coarse, all - without_heights};
}

}  // namespace farfeel::bench
