// With F(c) = -k share depth gradient, a contact that was made anew is compared with what the old one, as a
// line, says at the new pose. Of their difference the tool's way explains
//   k slope way + |F| way / turn,
// a depth that follows the way and a direction that turns along it. If the difference is more, only a little of it, the
// share w, is felt at once: the new contact begins with w of what the old one had, which keeps the rest and loses it by
// and by, as fast as the force may slew and no slower than the ramp:
//   F = w' F(new) + (1 - w') F(old),   w' = w ... 1.
#include "haptic_core/contact/handover.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/contact/penalty.h"

namespace farfeel::contact {
namespace {

using spatial::Vector6;

constexpr double kSlope = 2;            ///< depth explained by a way: facing surfaces with texture on them
constexpr double kSteepest = 4;         ///< what is steeper than felt surfaces are: see is_credible()
constexpr double kTurn_m = 1e-3;        ///< of way in which a force turns by a radian
constexpr double kSameDirection = 0.9;  ///< cosine, of contacts that are one under two names
constexpr double kUnfelt_N = 0.01;      ///< what leaves with less is let go

glm::dvec3 slope_of(const Contact& c) {
  return {c.gradient[3], c.gradient[4], c.gradient[5]};
}

glm::dvec3 force_N(const Contact& c) {
  return -c.material.stiffness_N_per_m * std::max(c.depth_m, 0.0) * slope_of(c);
}

/// Of its spring along a way of the tool, at the force that it has now.
double work_of(const Contact& c, const Vector6& way) {
  return -c.material.stiffness_N_per_m * std::max(c.depth_m, 0.0) * c.gradient.dot(way);
}

double share_of(const Material& part, const Material& whole) {
  return whole.stiffness_N_per_m > 0 ? part.stiffness_N_per_m / whole.stiffness_N_per_m : 1;
}

}  // namespace

Handover::Way Handover::Way::between(const spatial::Pose& last_X_WT, const spatial::Pose& X_WT) noexcept {
  const glm::dvec3 turn = spatial::vector_from_rotation(X_WT.R * glm::conjugate(last_X_WT.R));
  return {.from_last = spatial::to_vector6(spatial::Twist{turn, X_WT.p - last_X_WT.p}),
          .p_WTo_last = last_X_WT.p,
          .p_WTo = X_WT.p};
}

Handover::Way Handover::way_of(std::uint32_t object, const spatial::Pose& X_WT,
                               const motion::MovingObjects& moving) const noexcept {
  const motion::Moved* moved = moving.find(object);
  return Way::between(moved ? moved->way_W * last_X_WT_ : last_X_WT_, X_WT);
}

/// How far the tool's point that is at p_W now has come.
double Handover::Way::at_m(const glm::dvec3& p_W) const noexcept {
  const glm::dvec3 turn{from_last[0], from_last[1], from_last[2]}, step{from_last[3], from_last[4], from_last[5]};
  return glm::length(step + glm::cross(turn, p_W - p_WTo));
}

/// Moves a line on to the new pose: its depth along the way, its rotations to about To as it is now.
void Handover::Way::go_on(Felt& felt) const noexcept {
  Contact& c = felt.contact;
  c.depth_m = std::min(c.depth_m + c.gradient.dot(from_last), felt.most_depth_m);
  const glm::dvec3 turn = glm::cross(p_WTo - p_WTo_last, slope_of(c));
  for (int k = 0; k < 3; ++k) c.gradient[k] -= turn[k];
}

/// Takes a contact of the last answer along with its object, then on along the tool's way as that sees it. Returns the
/// work that its spring did along it, at the force that it had.
double Handover::go_on(Felt& felt, const spatial::Pose& X_WT, const motion::MovingObjects& moving) const noexcept {
  Contact& c = felt.contact;
  if (const motion::Moved* moved = moving.find(c.object)) c = carried(c, moved->way_W);
  const Way way = way_of(c.object, X_WT, moving);
  const double work_J = felt.share * felt.place_share * work_of(c, way.from_last);
  way.go_on(felt);
  return work_J;
}

/// Of shares, for a change of force by so much in all.
double Handover::share_per_s(double change_N) const noexcept {
  constexpr double kAtOnce_N = 1e-6;
  return std::max(options_.slew_N_per_s / std::max(change_N, kAtOnce_N), 1 / options_.ramp_s);
}

/// What leaves under one id is one line: depth and slope such that force and stiffness are the sum's.
void Handover::leave(Felt felt, std::uint32_t id) noexcept {
  felt.contact.id = id;
  felt.contact.curvature = {};
  felt.most_depth_m = felt.contact.depth_m;
  felt.share *= felt.place_share;
  felt.place_share = 1;
  if (!(felt.share > 0) || felt.share * glm::length(force_N(felt.contact)) < kUnfelt_N) return;
  const auto end = leaving_.begin() + leaving_count_;
  const auto known = std::find_if(leaving_.begin(), end, [id](const Felt& other) { return other.contact.id == id; });
  if (known == end) {
    if (leaving_count_ < leaving_.size()) leaving_[leaving_count_++] = felt;
    return;
  }
  const double a_m = known->share * std::max(known->contact.depth_m, 0.0), b_m = felt.share * felt.contact.depth_m;
  const double share = known->share + felt.share;
  felt.contact.gradient = (a_m * known->contact.gradient + b_m * felt.contact.gradient) / (a_m + b_m);
  felt.contact.depth_m = (a_m + b_m) / share;
  felt.share = share;
  felt.share_per_s = std::min(felt.share_per_s, known->share_per_s);
  felt.most_depth_m = felt.contact.depth_m;
  *known = felt;
}

/// The contact has been there in the last answer, as `was`.
void Handover::take(Felt& now, Felt was, const Way& way, double dt_s) noexcept {
  now.share_per_s = was.share < 1 ? was.share_per_s : 0;
  now.share = std::min(was.share + dt_s * now.share_per_s, 1.0);
  const double step = dt_s * share_per_s(glm::length(force_N(now.contact)));
  now.place_share = std::clamp(now.place_share, was.place_share - step, was.place_share + step);
  if (was.is_provisional || now.is_provisional) return;
  const double way_m = way.at_m(now.contact.p_WC_W), explained_m = options_.free_depth_m + kSlope * way_m;
  const double change_m = std::abs(std::max(now.contact.depth_m, 0.0) - std::max(was.contact.depth_m, 0.0));
  const bool is_the_surfaces = change_m <= (now.is_coarse ? explained_m : options_.free_depth_m + kSteepest * way_m);
  if (was.made_from == now.made_from && is_the_surfaces) return;
  const glm::dvec3 before_N = force_N(was.contact), after_N = force_N(now.contact);
  const double jump_N = now.place_share * glm::distance(before_N, after_N);
  const double k = std::max(was.contact.material.stiffness_N_per_m, now.contact.material.stiffness_N_per_m);
  const double explained_N = k * explained_m + std::max(glm::length(before_N), glm::length(after_N)) * way_m / kTurn_m;
  if (!(jump_N > explained_N)) return;
  const double begins = std::min(k * options_.free_depth_m, explained_N) / jump_N;
  const double per_s = share_per_s(jump_N);
  now.share_per_s = was.share_per_s = was.share < 1 ? std::min(per_s, was.share_per_s) : per_s;
  now.share = begins * was.share;
  was.share *= 1 - begins;
  leave(was, now.contact.id | kLeaves);
}

/// The contact of the last answer that goes on as `now`: of the same name, or else of a name that is gone, on the same
/// object and in nearly the same direction, the one nearest in force. last_count_: none.
std::uint32_t Handover::predecessor_of(const Felt& now, const std::array<bool, kMaxContacts>& goes_on) const noexcept {
  std::uint32_t best = last_count_;
  double best_N = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < last_count_; ++i) {
    const Contact& was = last_[i].contact;
    if (was.id == now.contact.id) return i;
    const bool is_free = !goes_on[i] && std::none_of(now_.begin(), now_.begin() + now_count_,
                                                     [&](const Felt& other) { return other.contact.id == was.id; });
    if (!is_free || was.object != now.contact.object ||
        glm::dot(was.nhat_ST_W, now.contact.nhat_ST_W) < kSameDirection) {
      continue;
    }
    const double apart_N = glm::distance(force_N(was), force_N(now.contact));
    if (apart_N < best_N) best_N = apart_N, best = i;
  }
  return best;
}

/// Deeper than the tool's way explains, it begins with the energy of a shallow one; the rest comes in by and by.
void Handover::appear(Felt& now, const Way& way) const noexcept {
  const double explained_m = options_.free_depth_m + kSlope * way.at_m(now.contact.p_WC_W);
  if (!(now.contact.depth_m > explained_m) || now.is_provisional) return;
  const double begins = options_.free_depth_m / now.contact.depth_m;
  now.share = begins * begins;
  now.share_per_s = share_per_s(glm::length(force_N(now.contact)));
}

void Handover::apply(ContactSet& set, std::span<const Making> makings, const motion::MovingObjects& moving,
                     double dt_s) noexcept {
  const auto making_of = [&](std::uint32_t id) {
    const auto found = std::find_if(makings.begin(), makings.end(), [id](const Making& m) { return m.id == id; });
    return found == makings.end() ? Making{} : *found;
  };
  double work_J = 0;  // of springs along the way, at the forces before it and after
  if (has_last_) {
    for (std::uint32_t i = 0; i < last_count_; ++i) {
      // A line holds for a fraction of a ridge: beyond, a steep one would say anything.
      last_[i].most_depth_m = std::max(last_[i].contact.depth_m, 0.0) + options_.free_depth_m;
      work_J += go_on(last_[i], set.X_WT, moving);
    }
    for (std::uint32_t i = 0; i < leaving_count_; ++i) work_J += go_on(leaving_[i], set.X_WT, moving);
  } else {
    last_count_ = leaving_count_ = 0;
  }
  for (std::uint32_t i = 0; i < leaving_count_; ++i) leaving_[i].share -= dt_s * leaving_[i].share_per_s;

  now_count_ = set.count;
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const Making making = making_of(set.contacts[i].id);
    Felt& now = now_[i] = {.contact = set.contacts[i],
                           .made_from = making.made_from,
                           .is_provisional = making.is_provisional,
                           .is_coarse = making.is_coarse,
                           .place_share = share_of(set.contacts[i].material, making.material)};
    now.contact.material = making.material;
  }
  std::array<bool, kMaxContacts> goes_on{};
  for (std::uint32_t i = 0; i < now_count_; ++i) {
    const std::uint32_t before = predecessor_of(now_[i], goes_on);
    const Way way = way_of(now_[i].contact.object, set.X_WT, moving);
    if (before < last_count_) {
      goes_on[before] = true;
      take(now_[i], last_[before], way, dt_s);
    } else if (has_last_) {
      appear(now_[i], way);
    }
  }
  for (std::uint32_t i = 0; i < last_count_; ++i) {
    if (goes_on[i] || last_[i].is_provisional) continue;
    last_[i].share_per_s = share_per_s(last_[i].place_share * glm::length(force_N(last_[i].contact)));
    leave(last_[i], last_[i].contact.id);
  }
  const auto gone = std::remove_if(leaving_.begin(), leaving_.begin() + leaving_count_,
                                   [](const Felt& felt) { return !(felt.share > 0); });
  leaving_count_ = static_cast<std::uint32_t>(gone - leaving_.begin());

  handed_ = leaving_count_;
  double stored_J = 0;
  set.count = 0;
  const auto tell = [&](const Felt& felt, bool is_handed) {
    if (set.count == set.contacts.size()) return;
    Contact& contact = set.contacts[set.count++] = felt.contact;
    contact.material.stiffness_N_per_m *= felt.share * felt.place_share;
    contact.material.damping_Ns_per_m *= felt.share * felt.place_share;
    if (is_handed) contact.doubts |= kHandedOver;
    stored_J += penalty_energy_J(contact);
    work_J += work_of(contact, way_of(contact.object, set.X_WT, moving).from_last);
  };
  for (std::uint32_t i = 0; i < now_count_; ++i) {
    const bool is_handed = now_[i].share < 1;
    handed_ += is_handed;
    tell(now_[i], is_handed);
  }
  for (std::uint32_t i = 0; i < leaving_count_; ++i) tell(leaving_[i], true);
  made_J_ = has_last_ ? stored_J - last_stored_J_ + 0.5 * work_J : 0;
  last_stored_J_ = stored_J;
  last_ = now_;
  last_count_ = now_count_;
  last_X_WT_ = set.X_WT;
  has_last_ = true;
}

}  // namespace farfeel::contact
