// One contact as it came, from the remote or from the surfaces at hand. Nothing changes it afterwards: how it is let in
// is transition.h's, what it is felt as felt_contact.h's.
//
// Its gradient is the direction and a slope, bounded so that a wall beside a contact is not taken for its texture
// (tangent.h). Where the depth's second derivative came too, B of it in (dtheta, m) about the contact point adds
//   q.B q / 2,   q = (t dtheta, s l)
// The part that the exact motion m makes is left out of B. Within the lateral range B turns no slope by more than
// kMaxSlope, and t cuts dtheta so that it turns no couple by more than kMaxCouple_m: a soft maximum's curvature is true
// of its width alone.
#pragma once

#include <cstdint>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/local_model/tangent.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::local_model {

/// Where one contact of a tick comes from. Two in a row from the same place are one model at two poses; any other two
/// are an update, whose force and energy are bounded.
enum class Source : std::uint8_t {
  kTiles,      ///< evaluated at this very pose
  kOutline,    ///< the same, but some of its heights are stood in for by the outline's
  kNewRemote,  ///< the remote's, new since the tick before
  kOldRemote,  ///< the remote's, as in the tick before
};

struct Origin {
  Source source = Source::kNewRemote;
  double off_m = 0;   ///< how far its depth is from the true one, at most
  double news_s = 0;  ///< time constant with which it is followed, at least
};

/// Time constant with which a contact follows answers of that age: its direction, point and slope, and what of its
/// depth would be taken over at once. The rest of the depth is let in as ever: a surface is not to be fallen through.
[[nodiscard]] double news_s(double age_s) noexcept;

struct ReceivedContact {
  contact::Contact contact;
  spatial::Pose X0_WT;                               ///< the pose it was linearised at
  glm::dvec3 slope_W{0}, couple_W{0};                ///< at most kMaxSlope and kMaxCouple_m long
  spatial::Matrix6 bend = spatial::Matrix6::Zero();  ///< B, told or seen
  double bend_range_m = 0;                           ///< how far along the surface B holds; 0: not at all
  Origin origin;

  /// Evaluated at this pose, not linearised by the remote; and that with heights of the outline.
  [[nodiscard]] bool is_from_tiles() const noexcept { return origin.source == Source::kTiles || is_from_outline(); }
  [[nodiscard]] bool is_from_outline() const noexcept { return origin.source == Source::kOutline; }
  [[nodiscard]] bool is_bent() const noexcept { return bend_range_m > 0; }
  [[nodiscard]] Tangent tangent() const noexcept {
    return {X0_WT, contact.p_WC_W, contact.nhat_ST_W, slope_W, couple_W, contact.depth_m, contact.lateral_range_m};
  }

  /// What a tangent at X0 says with B.
  struct Bent {
    Tangent::At at;
    glm::dvec3 bend_slope_W{0};  ///< what B adds to the slope there
  };
  [[nodiscard]] Bent bent(const Tangent&, const spatial::Pose& X_WT, const Tangent::Turned&) const noexcept;
  /// B's part of the second derivative there, in the gradient's coordinates.
  [[nodiscard]] spatial::Matrix6 bend_at(const Tangent&, const spatial::Pose& X_WT,
                                         const Tangent::Turned&) const noexcept;
};

[[nodiscard]] ReceivedContact received(const contact::Contact&, const spatial::Pose& X0_WT,
                                       const Origin& = {}) noexcept;
/// The same after its object has gone a way, and it along.
[[nodiscard]] ReceivedContact carried(const ReceivedContact&, const spatial::Pose& way_W) noexcept;
/// The same after an older answer for the same place: as the gradient turned between them along the surface, it turns
/// on, where the depth grows by that. What it turned the other way pushes off late, and so calms.
[[nodiscard]] ReceivedContact bent_as_seen(const ReceivedContact&, const ReceivedContact& older) noexcept;

/// Whether a set may be felt at all: finite, count in range, unit directions, depths and materials of a sane size.
[[nodiscard]] bool is_usable(const contact::ContactSet&) noexcept;

}  // namespace farfeel::local_model
