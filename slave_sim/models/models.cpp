#include "slave_sim/models/models.h"

#include <algorithm>
#include <array>

namespace farfeel::slave_sim {
namespace {

constexpr contact::Material kSteel{
    .stiffness_N_per_m = 4000, .damping_Ns_per_m = 1.0, .static_friction = 0.25, .dynamic_friction = 0.2};
constexpr contact::Material kPlastic{
    .stiffness_N_per_m = 2500, .damping_Ns_per_m = 0.8, .static_friction = 0.35, .dynamic_friction = 0.3};

constexpr std::array kModels{
    Model{"block", 65'536, 16, 1, 1'200, kPlastic, block_mesh, block_base},
    Model{"gear", 25'600, 1'600, 1, 1'200, kPlastic, gear_mesh, gear_base},
    Model{"hammer", 433'152, 518, 210, 2'000, kSteel, hammer_mesh, nullptr},
    Model{"cad", 658'432, 720, 390, 2'700, kSteel, cad_part_mesh, nullptr},
    Model{"file", 285'824, 632, 113, 7'800, kSteel, file_mesh, nullptr},
    Model{"torus", 128'000, 532, 114, 1'200, kPlastic, helicoidal_torus_mesh, nullptr},
    Model{"probe", 20'480, 320, 1, 7'800, kSteel, probe_mesh, probe_base},
};

}  // namespace

std::span<const Model> models() {
  return kModels;
}

const Model* find_model(std::string_view name) {
  const auto found = std::find_if(kModels.begin(), kModels.end(), [&](const Model& m) { return m.name == name; });
  return found == kModels.end() ? nullptr : &*found;
}

}  // namespace farfeel::slave_sim
