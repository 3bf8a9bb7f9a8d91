// From a cluster and its penetration depth to a contact in the world.
#pragma once

#include <span>

#include "haptic_core/contact/cluster.h"
#include "haptic_core/contact/contact_set.h"
#include "haptic_core/penetration/penetration.h"

namespace farfeel::contact {

/// The contact frame of a cluster, in S: origin at its point, z along its direction, x and y off S's axes and fixed to
/// S while the direction is.
[[nodiscard]] spatial::Pose contact_frame(const Cluster&) noexcept;

/// Whether a depth may be felt: known, finite, and of a gradient that surfaces within 60 degrees of facing can have.
[[nodiscard]] bool is_credible(const penetration::Penetration&) noexcept;

/// Where the depth is not credible (the patches share nothing along the direction) the cluster's own point and depth
/// stand in. p_WTo: T's origin. Fields id, object, material and lateral range are left for the caller.
[[nodiscard]] Contact contact_from(const Cluster&, const penetration::Penetration& in_C, const spatial::Pose& X_WS,
                                   const glm::dvec3& p_WTo) noexcept;

/// The 6 x 6 second derivative turned from C to W.
[[nodiscard]] spatial::Matrix6 turned(const spatial::Matrix6& in_C, const glm::dquat& R_WC) noexcept;

}  // namespace farfeel::contact
