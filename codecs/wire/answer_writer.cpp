#include "codecs/wire/answer_message.h"
#include "codecs/wire/haptic_limits.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "codecs/wire/quantised.h"

namespace farfeel::codecs {
namespace {

using transport::ByteWriter;

constexpr double kLeastShare = 6.2e-5, kMostShare = 6e4;  // below and above, a half has fewer digits, or none
constexpr double kSameDamping = 1e-3;  // stiffness and damping of a contact that fades shrink alike, to so much

std::uint64_t bit(std::size_t place) {
  return std::uint64_t{1} << place;
}

ContactIdentity identity_of(const contact::Contact& c) {
  const contact::Material& m = c.material;
  return {c.id.number,
          c.object,
          static_cast<float>(m.stiffness_N_per_m),
          static_cast<float>(m.damping_Ns_per_m),
          static_cast<float>(m.static_friction),
          static_cast<float>(m.dynamic_friction)};
}

/// Nothing where `now` is not `base` with less, or more, of its stiffness and its damping.
std::optional<std::uint16_t> share_of(const ContactIdentity& now, const ContactIdentity& base, std::uint16_t whole) {
  if (now.static_friction != base.static_friction || now.dynamic_friction != base.dynamic_friction) return std::nullopt;
  if (now.stiffness_N_per_m == base.stiffness_N_per_m && now.damping_Ns_per_m == base.damping_Ns_per_m) return whole;
  const double share = static_cast<double>(now.stiffness_N_per_m) / static_cast<double>(base.stiffness_N_per_m);
  const double damping = now.damping_Ns_per_m, base_damping = share * static_cast<double>(base.damping_Ns_per_m);
  if (!(share >= kLeastShare && share <= kMostShare)) return std::nullopt;
  if (!(std::abs(damping - base_damping) <= kSameDamping * std::max(damping, base_damping))) return std::nullopt;
  return half_of(share);
}

void write_identity(ByteWriter& w, const ContactIdentity& identity, std::size_t like) {
  w.u8(like < kPlaces ? static_cast<std::uint8_t>(like) : kLikeNone);
  w.u32(identity.id);
  if (like < kPlaces) return;
  w.u32(identity.object);
  for (const float v :
       {identity.stiffness_N_per_m, identity.damping_Ns_per_m, identity.static_friction, identity.dynamic_friction})
    w.f32(static_cast<double>(v));
}

/// From the point on, to the range.
void write_geometry(ByteWriter& w, const contact::Contact& c, const spatial::Pose& X_WT, bool is_in_full,
                    double step_m) {
  glm::dvec3 p_ToC_W = c.p_WC_W - X_WT.p;
  if (is_in_full) {
    write_f64(w, p_ToC_W);
  } else if (const auto steps = steps_of(p_ToC_W, step_m)) {
    write_steps(w, *steps);
    p_ToC_W = from_steps(*steps, step_m);
  }
  w.f32(c.depth_m);
  const Direction direction = direction_of(c.nhat_ST_W);
  write_i24(w, direction.u);
  write_i24(w, direction.v);
  // Each remainder is of what is read so far, so that only its own rounding is left.
  const spatial::Twist gradient = spatial::twist_from(c.gradient);  // the two halves, by name
  const glm::dvec3 nhat_W = from_direction(direction).value_or(glm::dvec3{0});
  glm::dvec3 by_translation = -nhat_W;
  for (int i = 0; i < 3; ++i) {
    const std::uint16_t slope = half_of(gradient.linear_m_s[i] + nhat_W[i]);
    w.u16(slope);
    by_translation[i] += from_half(slope);
  }
  const glm::dvec3 of_arm = glm::cross(p_ToC_W, by_translation);
  for (int i = 0; i < 3; ++i) w.u16(half_of(gradient.angular_rad_s[i] - of_arm[i]));
  write_u24(w, float24_of(c.lateral_range_m));
}

/// Contacts by depth, the deepest first; of equally deep ones the first.
std::array<std::uint32_t, contact::kMaxContacts> by_depth(const contact::ContactSet& set, std::size_t count) {
  // NaN compares with nothing, which would break the sort; it goes last, and the reader refuses it.
  const auto depth = [&](std::uint32_t i) {
    const double depth_m = set.contacts[i].depth_m;
    return std::isnan(depth_m) ? -std::numeric_limits<double>::infinity() : depth_m;
  };
  std::array<std::uint32_t, contact::kMaxContacts> order;
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(count);
  std::iota(order.begin(), end, 0u);
  std::sort(order.begin(), end,
            [&](std::uint32_t a, std::uint32_t b) { return depth(a) > depth(b) || (depth(a) == depth(b) && a < b); });
  return order;
}

bool is_same(const spatial::Pose& a, const spatial::Pose& b) {
  return a.p == b.p && a.R == b.R;
}

}  // namespace

/// The place of a contact before `i` in the answer that is told with an identity like that of `i`, or kPlaces.
std::size_t AnswerWriter::told_before(const Entries& entries, const Going& goes, std::size_t i) noexcept {
  for (std::size_t j = 0; j < i; ++j)
    if (goes[j] && entries[j].is_told && entries[i].identity.is_like(entries[j].identity)) return entries[j].place;
  return kPlaces;
}

/// What contact `i` adds to an answer with those that go already. Of those that are alike the first in the answer is
/// told in full, and which one that is makes no difference to their sum.
std::size_t AnswerWriter::identity_bytes(const Entries& entries, const Going& goes, std::size_t i) noexcept {
  if (!entries[i].is_told) return 0;
  if (entries[i].like < kPlaces) return kLikeBytes;
  for (std::size_t j = 0; j < entries.size(); ++j) {
    const bool is_in_full = goes[j] && entries[j].is_told && entries[j].like == kPlaces;
    if (is_in_full && entries[i].identity.is_like(entries[j].identity)) return kLikeBytes;
  }
  return kIdentityBytes;
}

void AnswerWriter::reset(const PoseGrid& grid) noexcept {
  grid_ = grid;
  number_at_reset_ = number_;
  places_.fill({});
}

void AnswerWriter::acknowledge(std::optional<std::uint16_t> heard) noexcept {
  if (!heard) {
    for (Place& place : places_) place.is_acknowledged = false;
    return;
  }
  const std::uint32_t ago = static_cast<std::uint16_t>(number_ - *heard);
  if (ago >= kAnswersRemembered || ago >= number_ - number_at_reset_) return;
  const std::uint32_t answer = number_ - ago;
  const std::uint64_t held = held_[answer % kAnswersRemembered];
  for (std::size_t i = 0; i < kPlaces; ++i) {
    Place& place = places_[i];
    if (!place.is_given || place.is_acknowledged || (held & bit(i)) == 0) continue;
    place.is_acknowledged = static_cast<std::int32_t>(answer - place.given_at) >= 0;
  }
}

/// Where the contact is told already, if anywhere. A share that stands becomes the identity's own, as it is told
/// better.
AnswerWriter::Entry AnswerWriter::entry_of(const contact::Contact& contact, std::uint64_t taken) const noexcept {
  const ContactIdentity identity = identity_of(contact);
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const Place& place = places_[i];
    if (place.identity.id != identity.id || !place.is_given || place.identity.object != identity.object ||
        (taken & bit(i)) != 0)
      continue;
    const auto share = share_of(identity, place.identity, kWhole);
    const bool is_new = !share || (*share != kWhole && identity.stiffness_N_per_m == place.last_stiffness_N_per_m);
    if (is_new) return {i, true, true, kWhole, identity};
    return {i, false, !place.is_acknowledged, *share, place.identity};
  }
  return {.identity = identity};
}

/// Looks for a place that the master has, and whose identity is this one but for the id. What is new to the master may
/// as well be told as a share of such a place's.
void AnswerWriter::liken(Entry& entry, std::uint64_t acknowledged) const noexcept {
  Entry shared = entry;
  for (std::size_t i = 0; i < kPlaces && entry.is_told; ++i) {
    if ((acknowledged & bit(i)) == 0) continue;
    ContactIdentity like = places_[i].identity;
    if (entry.identity.is_like(like)) {
      entry.like = i;
      return;
    }
    if (entry.place < kPlaces || shared.like < kPlaces || entry.identity.object != like.object) continue;
    like.id = entry.identity.id;
    if (const auto share = share_of(entry.identity, like, kWhole)) {
      shared.share = *share;
      shared.identity = like;
      shared.like = i;
    }
  }
  entry = shared;
}

/// Never given, or else the one that was used longest ago. With twice as many places as contacts there is one.
std::size_t AnswerWriter::free_place(std::uint64_t taken) const noexcept {
  std::size_t best = kPlaces;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    if ((taken & bit(i)) != 0) continue;
    if (!places_[i].is_given) return i;
    if (best == kPlaces || number_ - places_[i].used_at > number_ - places_[best].used_at) best = i;
  }
  return best;
}

std::size_t AnswerWriter::write(const AnswerMessage& answer, const spatial::Pose& asked,
                                std::span<std::byte> to) noexcept {
  const contact::ContactSet& set = answer.set;
  const std::size_t count = std::min<std::size_t>(set.count, contact::kMaxContacts);
  const auto all = std::span(set.contacts).first(count);
  const bool is_asked = is_same(set.X_WT, asked);
  const ToldPose pose = told(set.X_WT, grid_);
  const bool is_on_grid = !is_asked && pose.steps && is_same(set.X_WT, from_told(pose, grid_));
  const bool is_in_full = std::any_of(all.begin(), all.end(), [&](const contact::Contact& c) {
    return !steps_of(c.p_WC_W - set.X_WT.p, grid_.step_m());
  });
  const bool is_curved =
      std::any_of(all.begin(), all.end(), [](const contact::Contact& c) { return c.curvature.is_known; });

  // taken: no other contact may have these places. acknowledged: what the master has there it still has after this.
  std::uint64_t taken = 0, acknowledged = 0;
  Entries entries;
  for (std::size_t i = 0; i < kPlaces; ++i) acknowledged |= places_[i].is_acknowledged ? bit(i) : 0;
  for (std::size_t i = 0; i < count; ++i) {
    entries[i] = entry_of(all[i], taken);
    if (entries[i].place == kPlaces) continue;
    taken |= bit(entries[i].place);
    if (entries[i].is_new) acknowledged &= ~bit(entries[i].place);
  }
  std::uint64_t lent = 0;
  for (std::size_t i = 0; i < count; ++i) {
    liken(entries[i], acknowledged);
    if (entries[i].like < kPlaces) lent |= bit(entries[i].like);
  }
  std::size_t size = kAnswerBlockBytes + (answer.line ? kLineValueBytes : 0) +
                     (is_asked     ? 0
                      : is_on_grid ? kGridPoseBytes
                                   : kFullPoseBytes);
  if (size > to.size()) return 0;
  Going goes{};
  std::size_t going = 0;
  const auto order = by_depth(set, count);
  for (const std::uint32_t i : std::span(order).first(count)) {
    size += kContactBytes + (is_in_full ? 24 - 9 : 0) + (entries[i].share != kWhole ? kShareBytes : 0) +
            identity_bytes(entries, goes, i) + (is_curved ? kCurvedBytes : 0);
    if (size > to.size()) break;
    goes[i] = true;
    ++going;
  }

  if (++number_ == 0) ++number_;
  ByteWriter w(to);
  w.u8(static_cast<std::uint8_t>((is_asked     ? kPoseAsAsked
                                  : is_on_grid ? kPoseOnGrid
                                               : kPoseInFull) |
                                 (is_in_full ? kPointsInFull : 0) | (is_curved ? kAreCurved : 0) |
                                 (answer.line ? kHasLine : 0)));
  w.u8(static_cast<std::uint8_t>(going));
  left_out_ = static_cast<std::uint32_t>(count - going);
  w.u8(static_cast<std::uint8_t>(left_out_));
  w.u16(static_cast<std::uint16_t>(std::min<std::uint32_t>(set.pairs_near, 0xFFFF)));
  w.u32(number_);
  w.u32(set.pose_sequence);
  write_times(w, answer.times);
  write_halves(w, spatial::to_vector6(set.F_To_W));
  if (!is_asked) is_on_grid ? write_told(w, pose) : write_pose(w, set.X_WT);
  if (answer.line) write_line(w, *answer.line);

  std::uint64_t held = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!goes[i]) continue;
    Entry& entry = entries[i];
    if (entry.place == kPlaces) taken |= bit(entry.place = free_place(taken | lent));
    Place& place = places_[entry.place];
    if (entry.is_new)
      place = {.identity = entry.identity, .is_given = true, .is_acknowledged = false, .given_at = number_};
    place.used_at = number_;
    place.last_stiffness_N_per_m = identity_of(all[i]).stiffness_N_per_m;
    held |= bit(entry.place);
    w.u8(static_cast<std::uint8_t>(entry.place | (entry.share != kWhole ? kHasShare : 0u) |
                                   (entry.is_told ? kHasIdentity : 0u)));
    w.u8(static_cast<std::uint8_t>(all[i].doubts & kWireDoubts));
    write_geometry(w, all[i], set.X_WT, is_in_full, grid_.step_m());
    if (entry.share != kWhole) w.u16(entry.share);
    if (entry.is_told)
      write_identity(w, entry.identity, entry.like < kPlaces ? entry.like : told_before(entries, goes, i));
    if (is_curved) {
      const contact::Curvature& curvature = all[i].curvature;
      for (const float value : curvature.upper) write_u24(w, curvature.is_known ? float24_of(value) : 0);
    }
  }
  held_[number_ % kAnswersRemembered] = held;
  return w.ok() ? w.size() : 0;
}

}  // namespace farfeel::codecs
