// A scene from anybody. What is accepted must hold what its reader promises, and be fit to be written again.

#include <cstdlib>

#include "codecs/mesh/draco_bounds.h"
#include "codecs/scene/scene_description.h"

using namespace farfeel;

namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

void check(const geometry::TriangleMesh& mesh, const std::vector<codecs::Colour>& colours) {
  demand(colours.empty() || colours.size() == mesh.positions_O.size());
  demand(!mesh.triangles.empty());
  for (const glm::dvec3& p : mesh.positions_O) demand(spatial::is_finite(p));
  for (const geometry::Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t index : triangle) demand(index < mesh.positions_O.size());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto blob = std::as_bytes(std::span(bytes, size));
  (void)codecs::draco_bounds(blob);
  const auto scene = codecs::read_scene(blob);
  if (!scene) return 0;
  demand(scene->tolerance_m > 0 && scene->tool.mass_kg > 0 && scene->workspace_scale > 0 && scene->force_scale > 0);
  check(scene->tool.visible_T, scene->tool.colours);
  for (const codecs::SceneObject& object : scene->objects) {
    demand(spatial::is_valid(object.X_WO));
    check(object.visible_O, object.colours);
    demand(object.may_change ? !object.motion : object.is_there);
    if (object.motion) demand(spatial::is_valid(object.motion->at(0.37).X_WO));
  }
  return 0;
}
