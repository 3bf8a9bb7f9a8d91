// What is felt of an asset of version 2 of FARFEEL_haptic_surface: written by nobody any more, read for good.
#pragma once

#include "codecs/asset/asset_json.h"
#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::codecs {

/// surface: the root's extension. Bytes may be hostile; what fails is in the reader. May have faults.
[[nodiscard]] geometry::HapticSurface read_felt_of_version_2(AssetJson&, const nlohmann::json& surface);

}  // namespace farfeel::codecs
