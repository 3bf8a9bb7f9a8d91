// Which axis of a file points up: scenes and pictures have z there.
#pragma once

#include <string>

#include "codecs/mesh/mesh_parts.h"

namespace farfeel::slave_sim {

/// For an option's check: empty for x, y and z.
[[nodiscard]] std::string complaint_about_axis(const std::string& axis);

/// Turns what was read so that the axis becomes z, the other two in their order; z, or unsaid (empty): as it is. No
/// coordinate changes but by its place and sign. Precondition: complaint_about_axis() has none, or empty.
void turn_up(codecs::MeshInFile&, const std::string& axis);
/// The same of where parts stand; their shapes stay.
void turn_up(codecs::MeshParts&, const std::string& axis);

}  // namespace farfeel::slave_sim
