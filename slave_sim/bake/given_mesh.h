// Anybody's mesh file as the bake takes it: read, measured, mended or refused, with a line about everything found. What
// `farfeel bake` does and what `farfeel bake --check` says are this one function.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "codecs/mesh/mesh_file.h"
#include "haptic_core/geometry/triangle_mesh.h"
#include "slave_sim/bake/repair.h"

namespace farfeel::slave_sim {

struct GivenMesh {
  geometry::TriangleMesh mesh;          ///< closed, oriented; empty where it is refused
  geometry::TriangleMesh in_file;       ///< as the file has it, in the mesh's frame
  geometry::TriangleMesh left_out;      ///< of what can be felt of the file (repair.h)
  std::vector<codecs::Colour> colours;  ///< of in_file's vertices, or none
  std::vector<std::string> told;        ///< a line each: "read: ..", "repaired: ..", "size: ..", "mind: .."
  std::string refusal;                  ///< why it cannot be baked, and what to do; empty: it can
  bool is_sound = true;                 ///< nothing was mended, passed over or doubtful
};

enum class UnitUnsaid {
  kIsAsked,   ///< refused where no hand could hold the thing in metres
  kIsGuessed  ///< looked at as millimetres then, with a line that asks
};

/// unit: as unit_of_length.h has it; empty: unsaid. The file's name is in every refusal. doing: told what is being
/// done. up: as up_axis.h has it; every place that is told is where it is then.
[[nodiscard]] GivenMesh given_mesh(const std::string& file, const std::string& unit,
                                   UnitUnsaid if_unsaid = UnitUnsaid::kIsAsked, const Openings& = {},
                                   const std::function<void(const std::string&)>& doing = {},
                                   const std::string& up = {});

/// The same of a mesh that has been read already, or of why it was not.
[[nodiscard]] GivenMesh given_mesh(const codecs::MeshResult& read, const std::string& called, const std::string& unit,
                                   UnitUnsaid if_unsaid = UnitUnsaid::kIsAsked, const Openings& = {},
                                   const std::function<void(const std::string&)>& doing = {});

}  // namespace farfeel::slave_sim
