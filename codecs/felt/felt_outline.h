// What is felt of a scene but for its tiles, as bytes: coarse meshes, pieces, charts, materials, and the coarsest level
// of heights, which stands in for tiles until they are here.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/contact_service/felt_scene.h"

namespace farfeel::codecs {

// Bounds of the format: the writer refuses to exceed them, the reader refuses them before it allocates.
inline constexpr std::uint32_t kMaxFeltBodies = 257;         ///< a tool and 256 objects
inline constexpr std::uint32_t kMaxFeltTriangles = 1 << 16;  ///< of one body; as many vertices, pieces and charts
inline constexpr std::uint32_t kMaxFeltTiles = 1 << 16;      ///< of all bodies: 134 MB of heights at the master

/// bodies: the tool, then the objects, all prepared. to_come: other versions of their tiles, for which the bounds and
/// limits hold as well, though nobody was told of them. Fails on what is out of bounds, and on charts whose tiles do
/// not stand one after the other.
[[nodiscard]] tl::expected<std::vector<std::byte>, std::string> write_felt_outline(
    std::span<const contact_service::TouchableObject> bodies, const contact_service::ContactOptions&,
    std::span<const contact::SurfaceEdit> to_come = {});

/// For bytes from anybody: bounds are checked before anything is allocated, and every value before it is used. Heights
/// are those of the coarsest level.
[[nodiscard]] tl::expected<contact_service::FeltScene, std::string> read_felt_outline(std::span<const std::byte>);

}  // namespace farfeel::codecs
