#include <algorithm>
#include <cmath>

#include "codecs/wire/answer_message.h"
#include "codecs/wire/haptic_limits.h"
#include "codecs/wire/quantised.h"

namespace farfeel::codecs {
namespace {

double read_half(CheckedReader& r, double low, double high) {
  return r.checked(from_half(r.raw().u16()), low, high);
}

/// All zero: none is known.
contact::Curvature read_curvature(CheckedReader& r) {
  contact::Curvature curvature;
  for (float& entry : curvature.upper) {
    entry = static_cast<float>(r.checked(from_float24(read_u24(r.raw())), -kMaxCurvature, kMaxCurvature));
    curvature.is_known = curvature.is_known || entry != 0;
  }
  return curvature;
}

}  // namespace

void AnswerReader::reset() noexcept {
  has_read_ = false;
  places_.fill({});
}

ContactIdentity AnswerReader::read_identity(CheckedReader& r) const noexcept {
  const std::uint8_t like = r.raw().u8();
  ContactIdentity identity;
  if (like < kPlaces) {
    if (!next_[like].is_known) r.refuse(Fault::kNoBase);
    identity = next_[like].identity;
    identity.id = r.raw().u32();
    return identity;
  }
  if (like != kLikeNone) r.refuse();
  identity.id = r.raw().u32();
  identity.object = r.raw().u32();
  identity.stiffness_N_per_m = static_cast<float>(r.f32(0, kMaxStiffness_N_per_m));
  identity.damping_Ns_per_m = static_cast<float>(r.f32(0, kMaxDamping_Ns_per_m));
  identity.static_friction = static_cast<float>(r.f32(0, kMaxFriction));
  identity.dynamic_friction = static_cast<float>(r.f32(0, kMaxFriction));
  return identity;
}

void AnswerReader::read_contact(CheckedReader& r, std::uint8_t flags, const PoseGrid& grid,
                                contact::Contact& c) noexcept {
  const std::uint8_t how = r.raw().u8();
  Known& known = next_[how % kPlaces];
  const std::uint64_t bit = std::uint64_t{1} << (how % kPlaces);
  if ((taken_ & bit) != 0) r.refuse();  // two contacts at one place
  taken_ |= bit;
  c.doubts = r.raw().u8();
  if ((c.doubts & ~kWireDoubts) != 0) r.refuse();

  const glm::dvec3 p_ToC_W =
      (flags & kPointsInFull) != 0 ? r.vector_f64(kMaxCoordinate_m) : from_steps(read_steps(r), grid.step_m());
  c.p_WC_W = at_hand_.set.X_WT.p + p_ToC_W;
  c.depth_m = r.f32(-kMaxCoordinate_m, kMaxCoordinate_m);
  const std::int32_t u = read_i24(r.raw()), v = read_i24(r.raw());
  const auto nhat_W = from_direction({u, v});
  if (!nhat_W) r.refuse();
  c.nhat_ST_W = nhat_W.value_or(glm::dvec3{0, 0, 1});

  glm::dvec3 by_translation, by_rotation;
  for (int i = 0; i < 3; ++i) by_translation[i] = read_half(r, -kMaxGradient, kMaxGradient) - c.nhat_ST_W[i];
  const glm::dvec3 of_arm = glm::cross(p_ToC_W, by_translation);
  for (int i = 0; i < 3; ++i) by_rotation[i] = read_half(r, -kMostHalf, kMostHalf) + of_arm[i];
  c.gradient = spatial::to_vector6(spatial::Twist{by_rotation, by_translation});
  for (int i = 0; i < 6; ++i) r.checked(c.gradient[i], -kMaxGradient, kMaxGradient);
  c.lateral_range_m = r.checked(from_float24(read_u24(r.raw())), 0, kMaxCoordinate_m);

  const double share = (how & kHasShare) != 0 ? read_half(r, 0, kMostHalf) : 1;
  if ((how & kHasIdentity) != 0) known = {read_identity(r), true};
  if (!known.is_known) r.refuse(Fault::kNoBase);
  const ContactIdentity& identity = known.identity;
  c.id = identity.id;
  c.object = identity.object;
  c.material = {.stiffness_N_per_m = share * static_cast<double>(identity.stiffness_N_per_m),
                .damping_Ns_per_m = share * static_cast<double>(identity.damping_Ns_per_m),
                .static_friction = static_cast<double>(identity.static_friction),
                .dynamic_friction = static_cast<double>(identity.dynamic_friction)};
  r.checked(c.material.stiffness_N_per_m, 0, kMaxStiffness_N_per_m);
  r.checked(c.material.damping_Ns_per_m, 0, kMaxDamping_Ns_per_m);
  c.curvature = (flags & kAreCurved) != 0 ? read_curvature(r) : contact::Curvature{};
}

Fault AnswerReader::read_at_hand(CheckedReader& r, const PoseWriter& sent) noexcept {
  contact::ContactSet& set = at_hand_.set;
  const std::uint8_t flags = r.raw().u8();
  const std::uint8_t pose_form = flags & kPoseMask;
  if (flags > (kPoseMask | kPointsInFull | kAreCurved | kHasLine) || pose_form == kPoseMask) r.refuse();
  set.count = r.raw().u8();
  at_hand_.left_out = r.raw().u8();
  set.pairs_near = r.raw().u16();
  at_hand_.number = r.raw().u32();
  pose_at_hand_ = r.raw().u32();
  at_hand_.times = read_times(r.raw());
  set.F_To_W = spatial::wrench_from(read_halves(r, kMaxForce));
  if (set.count > contact::kMaxContacts || at_hand_.number == 0) r.refuse();
  if (r.fault() != Fault::kNone) return r.fault();
  if (has_read_ && static_cast<std::int32_t>(at_hand_.number - newest_) <= 0) return Fault::kOld;
  const SentPose* const pose = sent.find(pose_at_hand_);
  if (!pose) return Fault::kNoBase;
  set.pose_sequence = pose->sequence;
  set.pose_time_ns = 1000 * pose->time_us;
  set.X_WT = pose_form == kPoseAsAsked  ? pose->X_WT
             : pose_form == kPoseOnGrid ? read_told(r, false, sent.grid())
                                        : r.pose();
  at_hand_.line.reset();
  if ((flags & kHasLine) != 0) at_hand_.line = r.line();
  next_ = places_;
  taken_ = 0;
  for (std::size_t i = 0; i < set.count && r.fault() == Fault::kNone; ++i)
    read_contact(r, flags, sent.grid(), set.contacts[i]);
  if (r.fault() != Fault::kNone) return r.fault();
  return r.raw().is_at_end() ? Fault::kNone : Fault::kLength;
}

Fault AnswerReader::read(std::span<const std::byte> message, const PoseWriter& sent, AnswerMessage& out) noexcept {
  CheckedReader r(message);
  if (const Fault fault = read_at_hand(r, sent); fault != Fault::kNone) return fault;
  has_read_ = true;
  newest_ = at_hand_.number;
  newest_pose_ = pose_at_hand_;
  places_ = next_;
  const contact::ContactSet& set = at_hand_.set;
  std::copy_n(set.contacts.begin(), set.count, out.set.contacts.begin());
  out.number = at_hand_.number;
  out.times = at_hand_.times;
  out.left_out = at_hand_.left_out;
  out.line = at_hand_.line;
  out.set.pose_sequence = set.pose_sequence;
  out.set.pose_time_ns = set.pose_time_ns;
  out.set.X_WT = set.X_WT;
  out.set.count = set.count;
  out.set.F_To_W = set.F_To_W;
  out.set.pairs_near = set.pairs_near;
  return Fault::kNone;
}

}  // namespace farfeel::codecs
