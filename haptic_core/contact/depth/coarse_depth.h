// What the coarse pieces alone say about a contact: exact signed distances of its near pairs, whatever stands in each
// other's way. It is the floor under a height field's answer where surfaces are none along the contact's direction:
// threads, undercuts, tips that show the direction only their flanks.
#pragma once

#include <span>

#include "haptic_core/collision/proximity.h"
#include "haptic_core/contact/cluster.h"
#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/depth_source.h"

namespace farfeel::contact {

/// Soft maximum of the depths of the cluster's pairs, w ln(sum of exp(depth / w)): continuous when the deepest pair
/// changes. Pairs count as squarely as their own direction leads out of S, into T and along the cluster's.
/// Realtime-safe.
[[nodiscard]] DepthSource coarse_depth(const Cluster&, std::span<const collision::ProximityPair>,
                                       const glm::dvec3& p_STo_S, double soft_width_m) noexcept;

/// The least that is felt of a contact: the felt surfaces lie within margin_m of the coarse ones. But where an edge or
/// nothing but the coarse pieces decides, a soft maximum has little to sum, and what is apart is as far as they are.
[[nodiscard]] double least_depth_m(const DepthSource& coarse, double margin_m, double soft_width_m,
                                   bool is_at_edge) noexcept;

/// A contact is never shallower than floor_m. Depth, gradient and point become those of the soft maximum of both, which
/// has one energy: no step where one takes over from the other. Returns the floor's share of it, [0, 1].
double keep_above(Contact&, const DepthSource&, double floor_m, double soft_width_m, const spatial::Pose& X_WS,
                  bool is_known) noexcept;

/// Whether the nearest of all near pairs is about as far as a contact that is apart: two ways to know one gap, so that
/// nothing that either says of itself puts it in doubt.
[[nodiscard]] bool confirms_gap(std::span<const collision::ProximityPair>, double depth_m) noexcept;

}  // namespace farfeel::contact
