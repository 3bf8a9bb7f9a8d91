// Two textured plates as both ends know them: the remote with all heights, the operator's end with none yet.
#pragma once

#include "codecs/felt/felt_outline.h"
#include "haptic_core/local_model/local_contacts.h"
#include "slave_sim/models/height_plate.h"

namespace farfeel::test_support {

struct TiledPlates {
  geometry::HapticSurface table = slave_sim::ridged_plate(3e-3, 0.3e-3);
  geometry::HapticSurface tool = slave_sim::ridged_plate(2e-3, 0.05e-3, {.size_m = {0.008, 0.006, 0.004}});
  contact::Material material;

  /// The tool turned over, over the table, its mean plane pressed in by depth_m where x is.
  [[nodiscard]] static spatial::Pose pose(double x_m, double depth_m) {
    return {glm::dquat{0, 1, 0, 0}, {x_m, 0.1e-3, -depth_m}};
  }
  [[nodiscard]] contact_service::ContactService remote(double most_stiffness_N_per_m = 0) const {
    const contact_service::TouchableObject object{.felt = &table, .material = material};
    return {{&object, 1}, {.felt = &tool, .material = material}, {.most_stiffness_N_per_m = most_stiffness_N_per_m}};
  }
  /// Geometry and coarsest heights, as they come by the wire.
  [[nodiscard]] contact_service::FeltScene outline() const {
    const penetration::FeltSurface felt_tool(tool), felt_table(table);
    const std::array bodies{
        contact_service::TouchableObject{.felt = &tool, .material = material, .prepared = &felt_tool},
        contact_service::TouchableObject{.felt = &table, .material = material, .prepared = &felt_table}};
    return codecs::read_felt_outline(codecs::write_felt_outline(bodies, {}).value()).value();
  }
  [[nodiscard]] const geometry::HeightTile& tile(const contact_service::SurfaceTile& where) const {
    return (where.surface == contact_service::kToolSurface ? tool : table).tiles[where.tile];
  }
  /// All of them, past the queue's room.
  void send_all(local_model::TileCache& cache) const {
    for (std::uint32_t s = 0; s < 2; ++s) {
      const std::size_t count = (s == contact_service::kToolSurface ? tool : table).tiles.size();
      for (std::uint32_t i = 0; i < count; ++i) {
        (void)cache.put({s, i}, tile({s, i}));
        cache.take_arrived(1);
      }
    }
  }
};

}  // namespace farfeel::test_support
