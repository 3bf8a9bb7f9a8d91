// Positions out of any Draco mesh that a glTF exporter may write.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::codecs {

/// The attribute of that unique id as positions. The counts in the bitstream's header are bounded by its length before
/// Draco allocates for them; indices are checked afterwards. Bitstreams with metadata are refused.
[[nodiscard]] tl::expected<geometry::TriangleMesh, std::string> draco_positions(std::span<const std::byte> bitstream,
                                                                                std::uint32_t position_id);

}  // namespace farfeel::codecs
