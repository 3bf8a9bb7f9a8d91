// What the remote node knows about touch at one tool pose: the contacts, and the wrench they add up to.
//
// A plain value of fixed size: it crosses threads in a latest_value and the network in one datagram.
#pragma once

#include <array>
#include <cstdint>

#include "haptic_core/contact/curvature.h"
#include "haptic_core/contact/material.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

inline constexpr std::size_t kMaxContacts = 32;  ///< the wire's hard cap; the source saw up to 7

/// Further bits of Contact::doubts, beside penetration::Doubt's.
enum ContactDoubt : std::uint8_t {
  /// Heights were missing, and the outline's were used; outline_off_m bounds the error. Set at the operator's end alone
  /// and never sent. It reuses bit 0, penetration::kNoOverlap, which contacts never carry.
  kFeltByOutline = 1u << 0,
  kFeltAsCoarse = 1u << 6,  ///< the coarse pieces decide more than half of it: no relief is felt
};
inline constexpr std::uint8_t kAllDoubts = 0x7E;  ///< those that are sent: all but bit 0

/// Who found a contact.
enum class ContactKind : std::uint8_t {
  kAnswered,     ///< the service whose answers are felt; the only kind that is told on the wire
  kFoundBeside,  ///< the operator's own service, beside a remote whose answers are felt
};

/// Which contact it is: two are the same where number and kind are. A number alone is of an answer.
struct ContactId {
  std::uint32_t number = 0;
  ContactKind kind = ContactKind::kAnswered;

  constexpr ContactId(std::uint32_t number_ = 0, ContactKind kind_ = ContactKind::kAnswered) noexcept
      : number(number_), kind(kind_) {}
  friend constexpr bool operator==(const ContactId&, const ContactId&) = default;
};

/// One contact between scene object S and tool T, linearised at ContactSet::X_WT.
struct Contact {
  ContactId id;              ///< persists while the cluster it came from does
  std::uint32_t object = 0;  ///< index of S in the scene
  glm::dvec3 p_WC_W{0};      ///< contact point [m]
  glm::dvec3 nhat_ST_W{0};   ///< unit, out of S, into T
  double depth_m = 0;        ///< > 0 overlaps, < 0 apart (near contacts are sent too: they are felt on approach)
  spatial::Vector6 gradient =
      spatial::Vector6::Zero();  ///< d depth / d (rotation [m/rad], translation [1]) of T about To, in W
  std::uint8_t doubts = 0;       ///< bits of penetration::Doubt and ContactDoubt: what to know before believing it
  double outline_off_m = 0;      ///< where kFeltByOutline: the depth is off by no more [m]; never told
  double lateral_range_m = 0;    ///< how far the linearisation is meant to hold across nhat [m]
  Material material;             ///< of the pair
  Curvature curvature;           ///< of the depth, where it was asked for
};

struct ContactSet {
  std::uint32_t pose_sequence = 0;  ///< of the tool pose it answers
  std::int64_t pose_time_ns = 0;    ///< that pose's sample time, which is scene time, echoed
  spatial::Pose X_WT;               ///< that pose, or where it leads, as it was asked for
  std::uint32_t count = 0;          ///< <= kMaxContacts
  std::array<Contact, kMaxContacts> contacts{};
  spatial::Wrench F_To_W;        ///< their sum on the tool about To, damping and friction included
  std::uint32_t pairs_near = 0;  ///< pairs of pieces nearer than the tolerance
};

/// A contact fixed to an object that has gone a way, and the tool along with it: its gradient is about To as it is
/// then.
[[nodiscard]] Contact carried(Contact, const spatial::Pose& way_W) noexcept;

}  // namespace farfeel::contact
