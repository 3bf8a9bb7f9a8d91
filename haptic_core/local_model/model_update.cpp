// A newer model in place of an older one. Each contact is one of three:
//   one that goes on   the same contact, looked at from where the tool is now (rung 3, in every tick). What it stores
//                      here and what its linearisation promised to store here differ by what that got wrong
//   an heir            starts with the force of those that it replaces, where they pushed and as they pointed
//   one that leaves    nobody replaces it: let go over some milliseconds (advance)
// In each the force changes by no more than a bounded step at once, and what is left over is let in or let go.
#include <algorithm>
#include <cmath>
#include <optional>

#include "haptic_core/local_model/felt_once.h"
#include "haptic_core/local_model/local_model.h"

namespace farfeel::local_model {
namespace {

constexpr double kSameContactRange_m = 0.02;  // a contact without its old id is sought this far
constexpr double kSameContactCosine = 0.5;    // and within this angle
/// One with another name goes on as the same if its point is this near, or else if it is as deep: where a line or a
/// face lies on another the point of a contact may be any of theirs.
constexpr double kRenamedRange_m = 0.003, kRenamedDepth_m = 50e-6;
constexpr double kGoesOnCosine = 0.94;  // 20 degrees: one that turns further in a tick is another contact
/// Across this gap nobody inherits: where the old contact pressed there is nothing any more.
constexpr double kHeirsGap_m = 1e-3;
/// One that is softer by more is no heir, and does not go on: where two contacts find the same place, the remote lets
/// one of them fade, and a force handed on to what hardly resists would be metres deep.
constexpr double kLeastStiffnessLeft = 0.5;
/// Depth that one contact may gain or lose beyond its linearisation, for the way that its point went: a slope that
/// changed by one. Textures stay below; what goes further has become another place.
constexpr double kSurprisePerWay = 1;
/// Of old answers a tool that swings hears its own swing: followed at once, a nut of 100 g on its bolt swings on at
/// 37 Hz, 200 ms later. Younger than kYoung_s they are as good as now; with kSlowestNews_s a seventh is left of that.
constexpr double kYoung_s = 0.01;
/// Ticks between answers: up to so many, nothing is to be guessed between them.
constexpr double kEveryTick = 1.5;

/// What is pressed in deeper than this cannot be out of its object's reach in the next answer, as long as its point has
/// moved along the surface by less than that: contacts are told of from farther away than both.
constexpr double kLostDeep_m = 1e-3, kLostWay_m = 1e-3;

/// Time constant with which a contact follows answers of that age: its direction, point and slope, and what of its
/// depth would be taken over at once. The rest of the depth is let in as ever: a surface is not to be fallen through.
double news_s(double age_s) {
  return std::clamp(age_s - kYoung_s, 0.0, kSlowestNews_s);
}

/// Rotation and translation of T about To, in W.
spatial::Vector6 way_of_tool(const spatial::Pose& from, const spatial::Pose& to) {
  return spatial::to_vector6(
      spatial::Twist{spatial::vector_from_rotation(glm::normalize(to.R * glm::conjugate(from.R))), to.p - from.p});
}

}  // namespace

/// What the contacts before an update hand on to one contact after it.
struct LocalModel::Inheritance {
  double force_N = 0;
  glm::dvec3 p_sum{0}, nhat_sum{0}, slope_sum{0};  // weighted by force
  glm::dvec3 friction_N{0};
  double friction_J = 0;
  bool is_sliding = false;
  double strongest_N = 0;
  SeenCurvature seen;  // of the strongest

  void add(const FeltContact& old, const FeltContact::Sample& at) {
    const double N = old.stiffness_N_per_m() * at.felt_m;
    const contact::FrictionLimits limits = old.friction_limits(at.felt_m);
    force_N += N;
    p_sum += N * at.p_ToC_W;
    nhat_sum += N * old.nhat_W;
    slope_sum += N * (old.slope_W + at.bend_slope_W);
    friction_N += limits.stiffness_N_per_m * old.friction.stretch_W;
    friction_J += contact::friction_energy_J(old.friction, limits);
    is_sliding = is_sliding || old.friction.is_sliding;
    if (N > strongest_N) strongest_N = N, seen = old.seen;
  }

  /// The friction that goes on with the same force, as far as the heir can hold it and no energy is added.
  [[nodiscard]] contact::Friction friction(const glm::dvec3& nhat, const contact::FrictionLimits& limits) const {
    const double k = limits.stiffness_N_per_m, held_N = glm::length(friction_N);
    if (!(k > 0) || !(held_N > 0)) return {};
    const double stretch_m = std::min(held_N / k, std::sqrt(2 * friction_J / k));
    contact::Friction heir{stretch_m / held_N * friction_N, is_sliding};
    contact::turn_to(heir, nhat);
    contact::slide(heir, limits, glm::dvec3(0));
    return heir;
  }
};

namespace {

bool resists_like(const FeltContact& old, const FeltContact& now) {
  return now.stiffness_N_per_m() >= kLeastStiffnessLeft * old.stiffness_N_per_m();
}

/// Whether one may go on as the other, names apart.
bool is_alike(const FeltContact& old, const FeltContact& now) {
  return !old.is_leaving && old.share == 1 && old.at_X0.object == now.at_X0.object &&
         old.is_from_tiles == now.is_from_tiles && old.is_from_outline == now.is_from_outline &&
         resists_like(old, now) && glm::dot(old.at_X0.nhat_ST_W, now.at_X0.nhat_ST_W) > kGoesOnCosine;
}

bool is_same(const FeltContact& old, const FeltContact& now) {
  return is_alike(old, now) && old.at_X0.id == now.at_X0.id;
}

bool is_renamed_same(const FeltContact& old, const FeltContact& now, bool is_alone, const spatial::Pose& X_WT) {
  if (!now.is_from_tiles || !is_alike(old, now)) return false;
  return glm::distance(old.at_X0.p_WC_W, now.at_X0.p_WC_W) < kRenamedRange_m ||
         (is_alone && std::abs(old.sample(X_WT).depth_m - now.sample(X_WT).depth_m) < kRenamedDepth_m);
}

}  // namespace

/// The contacts of an update on their way in. Only those that there are are ever made: all would be 100 kB a tick.
struct LocalModel::Arrivals {
  std::size_t count = 0;
  std::array<std::optional<FeltContact>, contact::kMaxContacts> felts;
  std::array<FeltContact::Sample, contact::kMaxContacts> at;  // of each as received
  std::array<Source, contact::kMaxContacts> source{};
  bool are_all_told = false;           // by the remote, of this place and the last: what was told before may hold on
  std::array<bool, kMaxFelt> stays{};  // of those before the update: they go on untouched
  std::array<bool, contact::kMaxContacts> goes_on{};
  std::array<bool, contact::kMaxContacts> has_past{};  // goes on, or is the heir of one that was not leaving
  std::array<std::optional<Inheritance>, contact::kMaxContacts> inheritances;

  void add(const FeltContact& contact, Source from, const spatial::Pose& X_WT) {
    source[count] = from;
    at[count] = contact.sample(X_WT);
    felts[count].emplace(contact), inheritances[count++].emplace();
  }
  [[nodiscard]] FeltContact& felt(std::size_t j) { return *felts[j]; }
  [[nodiscard]] const FeltContact& felt(std::size_t j) const { return *felts[j]; }
  [[nodiscard]] Inheritance& inheritance(std::size_t j) { return *inheritances[j]; }

  /// The one that takes an old contact's place: of the same id, or else the nearest that looks the same way. One that
  /// was leaving comes back as one that has no other past: left to itself, both would be felt.
  [[nodiscard]] std::size_t heir_of(const FeltContact& old, const glm::dvec3& p_ToC_W) const {
    std::size_t heir = count;
    double nearest_m = kSameContactRange_m;
    for (std::size_t j = 0; j < count; ++j) {
      const contact::Contact& contact = felt(j).at_X0;
      if (goes_on[j] || (old.is_leaving && has_past[j]) || contact.object != old.at_X0.object ||
          at[j].depth_m < -kHeirsGap_m || !resists_like(old, felt(j)) ||
          glm::dot(contact.nhat_ST_W, old.nhat_W) < kSameContactCosine)
        continue;
      const double distance_m = contact.id == old.at_X0.id ? -1 : glm::length(at[j].p_ToC_W - p_ToC_W);
      if (distance_m < nearest_m) nearest_m = distance_m, heir = j;
    }
    return heir;
  }
};

void LocalModel::hear(const contact::ContactSet& set, double age_s) noexcept {
  news_.hear(age_s);
  held_F_To_W_ = set.F_To_W;
}

void LocalModel::update(const contact::ContactSet& set, const spatial::Pose& X_WT, double age_s) noexcept {
  hear(set, age_s);
  if (!is_refreshed()) return;
  note_lost(set);
  Arrivals arrivals;
  arrivals.are_all_told = true;
  for (std::size_t j = 0; j < set.count; ++j)
    arrivals.add(arriving(set, j, Source::kNewRemote, age_s), Source::kNewRemote, X_WT);
  take_over(arrivals, X_WT);
}

void LocalModel::refresh(const TickContacts& tick, const spatial::Pose& X_WT) noexcept {
  if (!is_refreshed()) return;
  note_lost(tick.set);
  if (settings_.rung != Rung::kTiles) return take_over_beside(tick, X_WT);
  Arrivals arrivals;
  for (std::size_t j = 0; j < tick.set.count; ++j) {
    FeltContact felt = arriving(tick.set, j, tick.source[j], tick.remote_age_s);
    felt.off_m = tick.off_m[j];
    arrivals.add(felt, tick.source[j], X_WT);
  }
  take_over(arrivals, X_WT);
}

/// Contact i of a set, taken along with its object to now.
FeltContact LocalModel::arriving(const contact::ContactSet& set, std::size_t i, Source source,
                                 double remote_age_s) const noexcept {
  FeltContact felt = felt_contact(set.contacts[i], set.X_WT);
  const motion::Moved* const moved = moving_ ? moving_->find(set.contacts[i].object) : nullptr;
  if (moved) felt.go_along(moving_->way_since(*moved, 1e-9 * static_cast<double>(set.pose_time_ns)));
  felt.is_from_outline = source == Source::kOutline;
  felt.is_from_tiles = source == Source::kTiles || felt.is_from_outline;
  // What stands in for tiles on an object that moves comes and goes with its teeth: that is no echo of the tool.
  const bool stands_in = settings_.rung == Rung::kTiles && moved;
  if (!felt.is_from_tiles && !stands_in) felt.news_s = news_s(remote_age_s);
  return felt;
}

/// Rungs that feel the remote's contacts: those that it told of last, each as it went on since, where they still hold;
/// and what is found here where they do not, or where it has told of nothing yet.
void LocalModel::take_over_beside(const TickContacts& tick, const spatial::Pose& X_WT) noexcept {
  constexpr std::size_t kNew = kMaxFelt;
  const std::size_t told_count = tick.told ? tick.told->count : 0;
  std::array<std::optional<FeltContact>, contact::kMaxContacts> new_ones;
  std::array<std::size_t, contact::kMaxContacts> felt_as{};  // of what is told: the contact that it is by now, or kNew
  std::array<PlacedContact, contact::kMaxContacts> found, told;
  const auto place = [&tick](const FeltContact& felt) {  // what is found may be ahead of X_WT
    const FeltContact::Sample at = felt.sample(tick.set.X_WT);
    return PlacedContact{felt.at_X0.object, felt.at_X0.nhat_ST_W, glm::conjugate(tick.set.X_WT.R) * at.p_ToC_W,
                         at.depth_m, 0};
  };
  for (std::size_t t = 0; t < told_count; ++t) {
    felt_as[t] = kNew;
    for (std::size_t i = 0; i < count_ && !tick.is_told_new && felt_as[t] == kNew; ++i) {
      const FeltContact& old = contacts_[i];
      if (!old.is_leaving && !old.is_from_tiles && old.at_X0.id == tick.told->contacts[t].id) felt_as[t] = i;
    }
    if (felt_as[t] == kNew) new_ones[t] = arriving(*tick.told, t, Source::kNewRemote, tick.remote_age_s);
    told[t] = place(felt_as[t] == kNew ? *new_ones[t] : contacts_[felt_as[t]]);
  }
  for (std::size_t f = 0; f < tick.set.count; ++f)
    found[f] = placed(tick.set.contacts[f], tick.set.X_WT, tick.off_m[f]);
  const FeltOnce felt = felt_once({found.data(), tick.set.count}, {told.data(), told_count});

  Arrivals arrivals;
  arrivals.are_all_told = true;
  bool is_as_before = true;
  for (std::size_t t = 0; t < told_count; ++t) {
    if (!felt.told[t]) continue;
    const bool is_new = felt_as[t] == kNew;
    is_as_before = is_as_before && !is_new;
    if (!is_new) arrivals.stays[felt_as[t]] = true;
    arrivals.add(is_new ? *new_ones[t] : contacts_[felt_as[t]], is_new ? Source::kNewRemote : Source::kOldRemote, X_WT);
    arrivals.goes_on[arrivals.count - 1] = arrivals.has_past[arrivals.count - 1] = !is_new;
  }
  for (std::size_t f = 0; f < tick.set.count && arrivals.count < contact::kMaxContacts; ++f) {
    if (!felt.found[f]) continue;
    is_as_before = false;
    FeltContact here = arriving(tick.set, f, tick.source[f], 0);
    here.at_X0.depth_m = felt.found_depth_m[f];
    here.off_m = here.is_from_outline ? tick.off_m[f] : 0;
    arrivals.add(here, tick.source[f], X_WT);
  }
  for (std::size_t i = 0; i < count_; ++i)
    is_as_before = is_as_before && (arrivals.stays[i] || contacts_[i].is_leaving);
  if (!is_as_before) take_over(arrivals, X_WT);
}

/// One model at two poses: what is owed stays owed, direction, slope and point lag as far behind as they did. A depth
/// that jumps further than a texture can, or for longer than the tank may owe, and a point that jumps, are let in like
/// any update.
void LocalModel::go_on(const FeltContact& old, FeltContact& now, std::size_t count,
                       const spatial::Pose& X_WT) noexcept {
  const FeltContact::Sample promised = old.sample(X_WT);
  const double before_J = old.energy_with_friction_J(promised.felt_m);
  const double stiffness = now.stiffness_N_per_m(), force_N = stiffness * promised.felt_m;
  const double others = static_cast<double>(count);
  const glm::dvec3 lag_W = promised.p_ToC_W - now.sample(X_WT).p_ToC_W;
  const double lag_m = glm::length(lag_W), step_m = settings_.torque_step_Nm / others / std::max(force_N, 1e-9);
  now.offset_W = lag_m > step_m ? (1 - step_m / lag_m) * lag_W : old.offset_W;
  now.slope_W += old.slope_W - old.slope_goal_W;
  now.nhat_W = glm::normalize(now.nhat_W + old.nhat_W - old.at_X0.nhat_ST_W);
  now.recess_m = old.recess_m;
  now.most_m = old.most_m;
  if (!now.is_from_tiles) now.kept = old.kept;
  now.seen = old.seen;
  now.seen.see(way_of_tool(old.X0_WT, now.X0_WT), now.at_X0.gradient - old.at_X0.gradient);
  now.friction = old.friction;
  contact::turn_to(now.friction, now.nhat_W);

  const double way_m = glm::distance(now.X0_WT.p + old.sample(now.X0_WT).p_ToC_W, old.at_X0.p_WC_W + old.offset_W);
  const double free_N = settings_.free_step_N / others;
  const double less_m = kSurprisePerWay * way_m + free_N / std::max(stiffness, 1e-9);
  const double more_m = tank_.available_J() > 0 ? less_m : kSurprisePerWay * way_m;
  // One that has become stiffer pushes as it did; the rest is let in.
  const double base_m = promised.felt_m * std::min(1.0, old.stiffness_N_per_m() / std::max(stiffness, 1e-9));
  const FeltContact::Sample found = now.sample(X_WT);
  const double room_J = std::max(0.0, settings_.surprise_J + tank_.level_J());
  const double paid_m = std::sqrt(2 * (old.energy_J(promised.felt_m) + room_J) / std::max(stiffness, 1e-9));
  const double felt_m =
      std::clamp(found.felt_m, std::max(0.0, base_m - less_m), std::max(base_m, std::min(base_m + more_m, paid_m)));
  if (felt_m != found.felt_m) now.recess_m = found.depth_m - felt_m;
  contact::slide(now.friction, now.friction_limits(felt_m), glm::dvec3(0));
  tank_.add(before_J - now.energy_with_friction_J(felt_m));
}

/// Starts where the old force was, as strong as it was and as it pointed, but for a free step towards its own. Returns
/// what it stores in friction then.
double LocalModel::begin(FeltContact& felt, const Inheritance& before, std::size_t count,
                         const spatial::Pose& X_WT) noexcept {
  const double stiffness = felt.stiffness_N_per_m();
  if (stiffness <= 0) return 0;
  const double step_N = settings_.free_step_N / static_cast<double>(count);
  felt.seen = before.seen;
  const FeltContact::Sample at = felt.sample(X_WT);
  if (before.force_N > 0) {
    const glm::dquat turn_back = felt.X0_WT.R * glm::conjugate(X_WT.R);
    felt.offset_W = turn_back * (before.p_sum / before.force_N - at.p_ToC_W);
    felt.nhat_W = glm::normalize(before.nhat_sum);
    felt.slope_W = before.slope_sum / before.force_N;
    if (felt.is_bent()) felt.slope_W -= felt.sample(X_WT).bend_slope_W;
    felt.recess_m = felt.sample(X_WT).depth_m - before.force_N / stiffness;  // as deep as the force says
    follow(felt, 0, X_WT);
  }
  const double depth_m = felt.sample(X_WT).depth_m;
  const double wanted_N = stiffness * std::max(0.0, at.depth_m);
  const double news = share_after(news_.since_s(), felt.news_s);
  const double felt_N = before.force_N + std::clamp(news * (wanted_N - before.force_N), -step_N, step_N);
  felt.recess_m = felt_N > 0 ? depth_m - felt_N / stiffness : std::max(0.0, depth_m);
  const contact::FrictionLimits limits = felt.friction_limits(std::max(0.0, felt_N / stiffness));
  felt.friction = before.friction(felt.nhat_W, limits);
  return contact::friction_energy_J(felt.friction, limits);
}

/// A surface cannot let go so: the answer lost the contact, and whatever pushed there is not to be missed in silence.
bool LocalModel::is_lost_while_deep(const FeltContact& old, const contact::ContactSet& set) const noexcept {
  if (old.is_leaving || old.recess_m > 0) return false;
  const FeltContact::Sample there = old.sample(set.X_WT);
  if (!(there.felt_m > kLostDeep_m)) return false;
  const glm::dvec3 way = set.X_WT.p + there.p_ToC_W - old.at_X0.p_WC_W - old.offset_W;
  if (glm::length(way - glm::dot(way, old.nhat_W) * old.nhat_W) > kLostWay_m) return false;
  return std::none_of(set.contacts.begin(), set.contacts.begin() + set.count, [&](const contact::Contact& contact) {
    return contact.object == old.at_X0.object && glm::dot(contact.nhat_ST_W, old.nhat_W) > 0;
  });
}

void LocalModel::note_lost(const contact::ContactSet& set) noexcept {
  for (std::size_t i = 0; i < count_; ++i) lost_while_deep_ += is_lost_while_deep(contacts_[i], set);
}

void LocalModel::take_over(Arrivals& arrivals, const spatial::Pose& X_WT) noexcept {
  const auto last = contacts_.begin() + static_cast<std::ptrdiff_t>(count_);
  const bool is_alone = arrivals.count == 1 && std::count_if(contacts_.begin(), last, [](const FeltContact& felt) {
                                                 return !felt.is_leaving;
                                               }) == 1;
  std::array<bool, kMaxFelt>& has_gone_on = arrivals.stays;
  for (const bool is_renamed : {false, true}) {  // where flat faces meet, clusters change their names from tick to tick
    for (std::size_t j = 0; j < arrivals.count; ++j) {
      if (arrivals.source[j] == Source::kNewRemote) continue;
      for (std::size_t i = 0; i < count_ && !arrivals.goes_on[j]; ++i) {
        if (has_gone_on[i] || !(is_renamed ? is_renamed_same(contacts_[i], arrivals.felt(j), is_alone, X_WT)
                                           : is_same(contacts_[i], arrivals.felt(j))))
          continue;
        go_on(contacts_[i], arrivals.felt(j), arrivals.count, X_WT);
        arrivals.goes_on[j] = arrivals.has_past[j] = has_gone_on[i] = true;
      }
    }
  }
  Samples replaced;
  for (std::size_t i = 0; i < count_; ++i) {
    if (has_gone_on[i]) continue;
    replaced[i] = contacts_[i].sample(X_WT);
    if (contacts_[i].is_leaving || replaced[i].felt_m <= 0) continue;
    const std::size_t heir = arrivals.heir_of(contacts_[i], replaced[i].p_ToC_W);
    if (heir < arrivals.count) arrivals.has_past[heir] = true;
  }

  double before_J = 0, after_J = 0;  // of what is replaced, and of what replaces it
  std::size_t leaving = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    if (has_gone_on[i]) continue;
    const FeltContact& old = contacts_[i];
    const FeltContact::Sample& sample = replaced[i];
    before_J += old.energy_with_friction_J(sample.felt_m);
    const std::size_t heir = arrivals.heir_of(old, sample.p_ToC_W);
    const double force_N = old.stiffness_N_per_m() * sample.felt_m;
    // What stands in for tiles until they are here is soon gone again: old tangents are no better than those tiles.
    if (arrivals.are_all_told && heir < arrivals.count && force_N >= arrivals.inheritance(heir).strongest_N) {
      FeltContact& now = arrivals.felt(heir);
      now.keep(old);
      const bool is_between_ticks = news_.since_s() > kEveryTick * tick_s_;
      if (is_between_ticks && now.news_s == 0 && now.at_X0.id == old.at_X0.id) now.bend_as_seen(old);
    }
    if (force_N <= 0) continue;
    if (heir < arrivals.count) {
      arrivals.inheritance(heir).add(old, sample);
    } else {
      if (leaving != i) contacts_[leaving] = old;  // leaving <= i: never over one that is still to be read
      contacts_[leaving].is_leaving = true;
      contacts_[leaving].most_m = std::min(contacts_[leaving].most_m, sample.felt_m);
      ++leaving;
    }
  }
  leaving = std::min(leaving, kMaxFelt - arrivals.count);
  for (std::size_t i = 0; i < leaving; ++i)
    after_J += contacts_[i].energy_with_friction_J(contacts_[i].sample(X_WT).felt_m);
  double springs_J = 0;  // of the heirs: the part that can be shrunk
  for (std::size_t j = 0; j < arrivals.count; ++j) {
    if (arrivals.goes_on[j]) continue;
    FeltContact& felt = arrivals.felt(j);
    after_J += begin(felt, arrivals.inheritance(j), arrivals.count, X_WT);
    springs_J += felt.energy_J(felt.sample(X_WT).felt_m);
  }

  const double owed_J = springs_J + after_J - before_J;
  const double granted_J = owed_J > 0 ? tank_.take(owed_J) : owed_J;
  if (owed_J < 0) tank_.add(-owed_J);
  if (granted_J < owed_J && springs_J > 0) {
    ++truncations_;
    const double shrink = std::sqrt(std::max(0.0, springs_J - owed_J + granted_J) / springs_J);
    for (std::size_t j = 0; j < arrivals.count; ++j) {
      const FeltContact::Sample sample = arrivals.felt(j).sample(X_WT);
      if (!arrivals.goes_on[j] && sample.felt_m > 0)
        arrivals.felt(j).recess_m = sample.depth_m - shrink * sample.felt_m;
    }
  }
  for (std::size_t j = 0; j < arrivals.count; ++j) contacts_[leaving + j] = arrivals.felt(j);
  count_ = leaving + arrivals.count;
  stored_J_ = stored_energy_J(X_WT);
}

}  // namespace farfeel::local_model
