// What other programs understand of an asset's mass and friction: the draft extension KHR_physics_rigid_bodies.
#pragma once

#include <nlohmann/json.hpp>

#include "codecs/asset/asset.h"

namespace farfeel::codecs {

inline constexpr const char* kPhysicsExtension = "KHR_physics_rigid_bodies";

/// For the node: mass, principal inertia, and a collider of the node's own mesh with physics material 0.
[[nodiscard]] nlohmann::json physics_node(const Asset&);
/// For the document: that material, with both coefficients of friction.
[[nodiscard]] nlohmann::json physics_document(const Asset&);

}  // namespace farfeel::codecs
