// Any bytes as a mesh of every format: refused with a word, or a mesh whose indices are in range; and what the repair
// makes of it, openings filled or sheets made thick, is closed and oriented, or refused.
#include <algorithm>
#include <cstdlib>

#include "codecs/mesh/mesh_parts.h"
#include "slave_sim/bake/repair.h"

using namespace farfeel;

namespace {

void judge(const codecs::MeshResult& mesh) {
  if (!mesh) {
    if (mesh.error().message.empty()) std::abort();
    return;
  }
  for (const geometry::Triangle& t : mesh->triangles) {
    if (std::max({t[0], t[1], t[2]}) >= mesh->positions_O.size()) std::abort();
  }
  if (!mesh->colours.empty() && mesh->colours.size() != mesh->positions_O.size()) std::abort();
  for (const slave_sim::Openings& openings : {slave_sim::Openings{}, {.widest_m = {}, .thickness_m = 1e-3}}) {
    const auto repaired = slave_sim::repaired(*mesh, 1, openings);
    if (repaired && !geometry::is_closed_and_oriented(repaired->mesh)) std::abort();
  }
}

void judge(const tl::expected<codecs::MeshParts, codecs::MeshError>& parts) {
  if (!parts) {
    if (parts.error().message.empty()) std::abort();
    return;
  }
  for (const codecs::MeshPart& part : parts->parts) {
    if (part.shape >= parts->shapes.size() || parts->shapes[part.shape].triangles.empty()) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  judge(codecs::read_obj(bytes));
  judge(codecs::read_off(bytes));
  judge(codecs::read_ply(bytes));
  judge(codecs::read_stl(bytes));
  judge(codecs::read_gltf(bytes));
  judge(codecs::read_gltf_parts(bytes));
  judge(codecs::read_obj_parts(bytes));
  return 0;
}
