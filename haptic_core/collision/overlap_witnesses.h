// Where two overlapping hulls would touch, once the least translation has parted them.
#pragma once

#include "haptic_core/collision/convex_pair.h"

namespace farfeel::collision {

/// Moves witnesses that do not lie on their hulls, p_a on A's vertices, edge or face that reach farthest along the
/// direction, and p_b on B's against it, to the two places of these that are nearest to each other across the
/// direction. So (p_a - p_b) . direction stays depth_m. Faces that lie on each other and edges that run side by side
/// have many such places, and where only some directions are admissible there may be none that meet. Bounded; no
/// allocation.
void keep_on_hulls(const PlacedPair&, LeastTranslation&) noexcept;

}  // namespace farfeel::collision
