// A newer model in place of an older one. Each contact is one of three (match.h):
//   one that goes on   the same contact, looked at from where the tool is now (rung 3, in every tick). What it stores
//                      here and what its linearisation promised to store here differ by what that got wrong
//   a successor        starts with the force of those that it replaces, where they pushed and as they pointed
//   one that leaves    nobody replaces it: let go over some milliseconds (advance)
// In each the force changes by no more than a bounded step at once, and what is left over is let in or let go.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/local_model/constants.h"
#include "haptic_core/local_model/felt_once.h"
#include "haptic_core/local_model/local_model.h"

namespace farfeel::local_model {
namespace {

/// A surface cannot let go so: the answer lost the contact, and whatever pushed there is not to be missed in silence.
bool is_lost_while_deep(const FeltContact& old, const contact::ContactSet& set) {
  if (old.transition.is_leaving || old.transition.recess_m > 0) return false;
  const auto faces_its_way = [&](const contact::Contact& contact) {
    return contact.object == old.received.contact.object && glm::dot(contact.nhat_ST_W, old.transition.nhat_W) > 0;
  };
  if (std::any_of(set.contacts.begin(), set.contacts.begin() + set.count, faces_its_way)) return false;
  const FeltContact::Sample there = old.sample_there(set.X_WT);
  if (!(old.felt_m(there) > kLostDeep_m)) return false;
  const glm::dvec3 way = set.X_WT.p + there.p_ToC_W - old.received.contact.p_WC_W - old.transition.offset_W;
  return !(glm::length(across(way, old.transition.nhat_W)) > kLostWay_m);
}

}  // namespace

void LocalModel::hear(const contact::ContactSet& set, double age_s) noexcept {
  news_.hear(ablated(Mechanism::kNewsAge) ? 0 : age_s);
  held_F_To_W_ = set.F_To_W;
}

void LocalModel::update(const contact::ContactSet& set, const spatial::Pose& X_WT, double age_s) noexcept {
  hear(set, age_s);
  if (!is_refreshed()) return;
  look_from(X_WT);
  note_lost(set);
  arrivals_.count = 0;
  for (std::size_t j = 0; j < set.count; ++j)
    arrivals_.add(arriving(set, set.contacts[j], {.source = Source::kNewRemote}, age_s));
  take_over(true);
}

void LocalModel::refresh(const TickContacts& tick, const spatial::Pose& X_WT) noexcept {
  if (!is_refreshed()) return;
  look_from(X_WT);
  note_lost(tick.set);
  if (settings_.rung != Rung::kTiles) return take_over_beside(tick);
  arrivals_.count = 0;
  for (std::size_t j = 0; j < tick.set.count; ++j)
    arrivals_.add(arriving(tick.set, tick.set.contacts[j], {.source = tick.source[j], .off_m = tick.off_m[j]},
                           tick.remote_age_s));
  take_over(false);
}

void LocalModel::note_lost(const contact::ContactSet& set) noexcept {
  for (std::size_t i = 0; i < count_; ++i) lost_while_deep_ += is_lost_while_deep(contacts_[i], set);
}

/// A contact of a set, taken along with its object to now. age_s: of the remote's answers.
FeltContact LocalModel::arriving(const contact::ContactSet& set, const contact::Contact& contact, Origin origin,
                                 double age_s) const noexcept {
  const motion::Moved* const moved = moving_ ? moving_->find(contact.object) : nullptr;
  // What stands in for tiles on an object that moves comes and goes with its teeth: that is no echo of the tool.
  const bool stands_in = settings_.rung == Rung::kTiles && moved;
  const bool is_from_tiles = origin.source == Source::kTiles || origin.source == Source::kOutline;
  if (!is_from_tiles && !stands_in) origin.news_s = news_s(age_s);
  ReceivedContact now = received(contact, set.X_WT, origin);
  if (moved) now = carried(now, moving_->way_since(*moved, 1e-9 * static_cast<double>(set.pose_time_ns)));
  FeltContact felt = felt_contact(now);
  felt.pad_W = pad_W_;
  felt.look_from(X_WT_);
  return felt;
}

/// Rungs that feel the remote's contacts: those that it told of last, each as it went on since, where they still hold;
/// and what is found here where they do not, or where it has told of nothing yet.
void LocalModel::take_over_beside(const TickContacts& tick) noexcept {
  const spatial::Pose& X_found_WT = tick.set.X_WT;  // may be ahead of the tool
  const std::size_t told_count = tick.told ? tick.told->count : 0;
  std::array<std::optional<FeltContact>, contact::kMaxContacts> new_ones;
  std::array<std::size_t, contact::kMaxContacts>
      felt_as{};  // of what is told: the contact that it is by now, or kNoContact
  std::array<PlacedContact, contact::kMaxContacts> found, told;
  for (std::size_t t = 0; t < told_count; ++t) {
    felt_as[t] = kNoContact;
    for (std::size_t i = 0; i < count_ && !tick.is_told_new && felt_as[t] == kNoContact; ++i) {
      const FeltContact& old = contacts_[i];
      if (!old.transition.is_leaving && !old.received.is_from_tiles() &&
          old.received.contact.id == tick.told->contacts[t].id)
        felt_as[t] = i;
    }
    if (felt_as[t] == kNoContact)
      new_ones[t] = arriving(*tick.told, tick.told->contacts[t], {.source = Source::kNewRemote}, tick.remote_age_s);
    const FeltContact& by_now = felt_as[t] == kNoContact ? *new_ones[t] : contacts_[felt_as[t]];
    const FeltContact::Sample at =
        pad_W_ == glm::dvec3(0) ? sample(by_now, X_found_WT) : by_now.sample_there(X_found_WT);
    told[t] = {by_now.received.contact.object, by_now.received.contact.nhat_ST_W,
               glm::conjugate(X_found_WT.R) * at.p_ToC_W, at.depth_m, 0};
  }
  for (std::size_t f = 0; f < tick.set.count; ++f) found[f] = placed(tick.set.contacts[f], X_found_WT, tick.off_m[f]);
  const FeltOnce felt = felt_once({found.data(), tick.set.count}, {told.data(), told_count});

  arrivals_.count = 0;
  std::array<bool, kMaxFelt> stays{};
  bool is_as_before = true;
  for (std::size_t t = 0; t < told_count; ++t) {
    if (!felt.told[t]) continue;
    is_as_before = is_as_before && felt_as[t] != kNoContact;
    if (felt_as[t] != kNoContact) stays[felt_as[t]] = true;
    arrivals_.add(felt_as[t] == kNoContact ? *new_ones[t] : contacts_[felt_as[t]], felt_as[t]);
  }
  for (std::size_t f = 0; f < tick.set.count && arrivals_.count < contact::kMaxContacts; ++f) {
    if (!felt.found[f]) continue;
    is_as_before = false;
    contact::Contact here = tick.set.contacts[f];
    here.depth_m = felt.found_depth_m[f];
    const double off_m = tick.source[f] == Source::kOutline ? tick.off_m[f] : 0;
    arrivals_.add(arriving(tick.set, here, {.source = tick.source[f], .off_m = off_m}, 0));
  }
  for (std::size_t i = 0; i < count_; ++i)
    is_as_before = is_as_before && (stays[i] || contacts_[i].transition.is_leaving);
  if (!is_as_before) take_over(true);
}

/// Successors of what is replaced begin with its force.
void LocalModel::begin_new(const Match& match, bool are_all_told, Stored& stored) noexcept {
  std::array<bool, kMaxFelt> is_row_taken{};
  for (std::size_t j = 0; j < arrivals_.count; ++j) {
    if (match.is_old[j]) continue;
    FeltContact& now = arrivals_.felt[j];
    WarmStart before;
    std::size_t row_from = kNoContact;
    for (std::size_t i = 0; i < count_; ++i) {
      if (match.stays[i] || match.successor[i] != j) continue;
      const FeltContact& old = contacts_[i];
      const double force_N = old.stiffness_N_per_m() * old.felt_m();
      before.no_room_m = std::max(before.no_room_m, old.no_room_m);
      // What stands in for tiles until they are here is soon gone again: old tangents are no better than those tiles.
      if (are_all_told && force_N >= before.strongest_N) {
        now.keep(old);
        const bool is_between_ticks = news_.since_s() > kEveryTick * tick_s_;
        if (is_between_ticks && now.received.origin.news_s == 0 && now.received.contact.id == old.received.contact.id)
          now.received = bent_as_seen(now.received, old.received);
      }
      if (force_N > 0) before.add(old);
      if (force_N > 0 && force_N >= before.strongest_N && !is_row_taken[i]) now.row = old.row, row_from = i;
    }
    if (row_from != kNoContact) is_row_taken[row_from] = true;
    stored.rest_J += begin(now, before, news_.since_s(), count_, arrivals_.count, X_WT_);
    stored.springs_J += now.energy_J(now.felt_m());
  }
}

/// Those that nobody replaces leave, as many as there is room for; returns how many, and which they are.
std::size_t LocalModel::find_leaving(const Match& match, std::array<std::size_t, kMaxFelt>& which) noexcept {
  std::size_t leaving = 0;
  for (std::size_t i = 0; i < count_ && leaving < kMaxFelt - arrivals_.count; ++i) {
    FeltContact& old = contacts_[i];
    const double felt_m = old.felt_m();
    if (match.stays[i] || match.successor[i] != kNoContact || !(old.stiffness_N_per_m() * felt_m > 0)) continue;
    old.transition.is_leaving = true;
    old.transition.most_m = std::min(old.transition.most_m, felt_m);
    which[leaving++] = i;
  }
  return leaving;
}

/// are_all_told: by the remote, of this place and the last; what was told before may hold on.
void LocalModel::take_over(bool are_all_told) noexcept {
  const std::span<FeltContact> felt(contacts_.data(), count_), arriving(arrivals_.felt.data(), arrivals_.count);
  const Match match = local_model::match(felt, arriving, arrivals_.stays_as);
  for (std::size_t p = 0; p < match.goes_on_count; ++p) {
    const auto [i, j] = match.goes_on[p];
    const double level_J = has_rows() ? std::numeric_limits<double>::infinity() : tank_.level_J();
    give(go_on(felt[i], arriving[j], arriving.size(), level_J, X_WT_));
    arriving[j].row = felt[i].row;
  }

  double before_J = 0;  // of what is replaced
  for (std::size_t i = 0; i < count_; ++i)
    if (!match.stays[i]) before_J += felt[i].energy_with_friction_J(felt[i].felt_m());
  std::array<std::size_t, kMaxFelt> which;
  const std::size_t leaving = find_leaving(match, which);
  Stored after;
  for (std::size_t n = 0; n < leaving; ++n)
    after.rest_J += felt[which[n]].energy_with_friction_J(felt[which[n]].felt_m());
  begin_new(match, are_all_told, after);

  const double owed_J = after.springs_J + after.rest_J - before_J;
  const double granted_J = owed_J > 0 ? pay(owed_J) : owed_J;
  if (owed_J < 0) give(-owed_J);
  if (granted_J < owed_J && after.springs_J > 0) {
    ++truncations_;
    const double shrink = std::sqrt(std::max(0.0, after.springs_J - owed_J + granted_J) / after.springs_J);
    for (std::size_t j = 0; j < arriving.size(); ++j) {
      FeltContact& now = arriving[j];
      if (!match.is_old[j] && now.felt_m() > 0) now.transition.recess_m = now.here.depth_m - shrink * now.felt_m();
    }
  }
  for (std::size_t n = 0; n < leaving; ++n)
    if (which[n] != n) contacts_[n] = contacts_[which[n]];
  std::copy(arriving.begin(), arriving.end(), contacts_.begin() + static_cast<std::ptrdiff_t>(leaving));
  count_ = leaving + arriving.size();
  for (std::size_t i = 0; i < count_; ++i)
    if (contacts_[i].row == 0) contacts_[i].row = ++rows_named_;
  stored_J_ = stored_energy_J();
}

}  // namespace farfeel::local_model
