#include "haptic_core/local_model/transition.h"

#include <algorithm>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/local_model/constants.h"
#include "haptic_core/local_model/felt_contact.h"

namespace farfeel::local_model {
namespace {

/// Rotation and translation of T about To, in W.
spatial::Vector6 way_of_tool(const spatial::Pose& from, const spatial::Pose& to) {
  return spatial::to_vector6(
      spatial::Twist{spatial::vector_from_rotation(glm::normalize(to.R * glm::conjugate(from.R))), to.p - from.p});
}

/// What is let go, whose recess is below its goal, grows no deeper while the tool approaches a surface that it does not
/// touch yet. Returns the energy that this gives.
double hold_back(FeltContact& felt, double goal_m) {
  Transition& in = felt.transition;
  if (!(in.recess_m < goal_m) || ablated(Mechanism::kHoldBack)) {
    in.most_m = std::numeric_limits<double>::infinity();
    return 0;
  }
  double gives_J = 0;
  const double felt_m = felt.felt_m();
  const double most_m = std::max({0.0, felt.here.depth_m - goal_m, in.most_m});
  if (felt_m > most_m) {
    in.recess_m = felt.here.depth_m - most_m;
    gives_J = felt.energy_J(felt_m) - felt.energy_J(most_m);
  }
  in.most_m = std::min(felt_m, most_m);
  return gives_J;
}

/// The friction spring of a contact whose stiffness has fallen lets go too.
LetGo relaxed(FeltContact& felt, double felt_m, double before_J) {
  contact::slide(felt.friction, felt.friction_limits(felt_m), glm::dvec3(0));
  return {.gives_J = before_J - felt.energy_with_friction_J(felt_m)};
}

}  // namespace

void follow(FeltContact& felt, double dt_s, std::size_t count, const spatial::Pose& X_WT) noexcept {
  Transition& in = felt.transition;
  const glm::dvec3& nhat_goal_W = felt.received.contact.nhat_ST_W;
  const double news_s = felt.received.origin.news_s;
  const double cosine = glm::dot(in.nhat_W, nhat_goal_W);
  const double offset_m = glm::length(in.offset_W);
  const glm::dvec3 slope_left = felt.received.slope_W - in.slope_W;
  const double slope_left_length = glm::length(slope_left);
  if (cosine >= 1 - 1e-14 && offset_m == 0 && slope_left_length == 0) return;
  const double felt_m = felt.felt_m();
  const double force_N = felt.stiffness_N_per_m() * felt_m;
  const double step_N = kSlopeStep_N / std::max<double>(1, static_cast<double>(count));
  const double slope_share =
      ablated(Mechanism::kSlopeLag)
          ? 1
          : std::min(share_after(dt_s, news_s), step_N / std::max(force_N * slope_left_length, kLeastChange_N));
  in.slope_W = slope_share < 1 ? in.slope_W + slope_share * slope_left : felt.received.slope_W;
  const double bleed_s = std::max(kBleed_s, news_s), share = share_after(dt_s, bleed_s);
  const double snap = std::pow(kBleed_s / bleed_s, 2);  // what snaps is not slow
  in.offset_W *= offset_m < snap * kSamePointSnap_m ? 0.0 : 1 - share;
  const double angle_rad = std::acos(std::clamp(cosine, -1.0, 1.0));
  in.nhat_W =
      angle_rad < snap * kSameDirectionSnap_rad ? nhat_goal_W : glm::normalize(glm::mix(in.nhat_W, nhat_goal_W, share));
  contact::turn_to(felt.friction, in.nhat_W);
  felt.look_from(X_WT);
  if (felt_m > 0) in.recess_m = felt.here.depth_m - felt_m;
}

LetIn to_let_in(FeltContact& felt, double dt_s, std::size_t count, const spatial::Pose& X_WT) noexcept {
  Transition& in = felt.transition;
  const double goal_m = felt.beyond_received_m(X_WT) + felt.no_room_m;  // of the recess
  LetIn wanted{.gives_J = hold_back(felt, goal_m)};
  if (in.recess_m == goal_m) return wanted;
  wanted.felt_m = felt.felt_m();
  if (wanted.felt_m == 0) {  // nothing is stored: what is owed shrinks to what would be felt, at no cost
    in.recess_m = std::max(goal_m, felt.here.depth_m);
    if (in.recess_m == goal_m) return wanted;
  }
  const double left_m = in.recess_m - goal_m;
  double change_m = left_m * share_after(dt_s, kBleed_s);
  if (std::abs(left_m) < kDone_m) change_m = left_m;
  const double fastest_N = kBleed_N_per_s * dt_s / static_cast<double>(count);
  if (felt.stiffness_N_per_m() > 0) {
    const double fastest_m = fastest_N / felt.stiffness_N_per_m();
    change_m = std::clamp(change_m, -fastest_m, fastest_m);
  }
  const double ends_m = std::max(0.0, wanted.felt_m + change_m);
  wanted.change_m = change_m;
  wanted.costs_J = felt.energy_J(ends_m) - felt.energy_J(wanted.felt_m);
  return wanted;
}

void let_in(FeltContact& felt, const LetIn& wanted, double share) noexcept {
  double change_m = wanted.change_m;
  if (wanted.costs_J > 0 && share < 1) {
    const double ends_J = felt.energy_J(wanted.felt_m) + share * wanted.costs_J;
    change_m = std::sqrt(2 * ends_J / felt.stiffness_N_per_m()) - wanted.felt_m;
  }
  felt.transition.recess_m -= change_m;
}

// What is gone decays, and grows no deeper: its surface, drawn on as a plane, may lie across the tool's way.
LetGo leave(FeltContact& felt, double dt_s, std::size_t leaving) noexcept {
  Transition& in = felt.transition;
  double felt_m = felt.felt_m();
  const double before_J = felt.energy_with_friction_J(felt_m);
  const double pushed_N =
      static_cast<double>(leaving) * felt.stiffness_N_per_m() * felt_m;  // with what the last step sank in
  in.recess_m += std::max(0.0, felt_m - in.most_m);
  felt_m = in.most_m = std::min(felt_m, in.most_m);
  in.share *= std::exp(-dt_s / (kLeaving * kBleed_s));
  if (pushed_N < kSoonGone_N) in.share *= std::max(0.0, 1 - kLeave_N_per_s * dt_s / pushed_N);
  if (in.share <= kGone || felt_m == 0) return {.gives_J = before_J, .is_gone = true};
  return relaxed(felt, felt_m, before_J);
}

// A hand that is let go sinks deeper and deeper: the last of a stiffness would be as much force as the first.
LetGo fade(FeltContact& felt, double dt_s, std::size_t count) noexcept {
  Transition& in = felt.transition;
  const double felt_m = felt.felt_m(), before_J = felt.energy_with_friction_J(felt_m);
  const double whole_N = static_cast<double>(count) * felt.received.contact.material.stiffness_N_per_m * felt_m;
  const double calm_per_s = kLeave_N_per_s / std::max(whole_N, kLeastForce_N);
  const double slowest_per_s = in.share / (kSlowestFade * kFade_s);
  in.share -= dt_s * std::min(std::max(calm_per_s, slowest_per_s), 1 / kFade_s);
  if (in.share <= 0) return {.gives_J = before_J, .is_gone = true};
  return relaxed(felt, felt_m, before_J);
}

double go_on(const FeltContact& old, FeltContact& now, std::size_t count, double tank_level_J,
             const spatial::Pose& X_WT) noexcept {
  Transition& in = now.transition;
  const double promised_m = old.felt_m();
  const double before_J = old.energy_with_friction_J(promised_m);
  const double stiffness = now.stiffness_N_per_m(), force_N = stiffness * promised_m;
  const double others = static_cast<double>(count);
  const glm::dvec3 lag_W = old.here.p_ToC_W - now.here.p_ToC_W;
  const double lag_m = glm::length(lag_W), step_m = kTorqueStep_Nm / others / std::max(force_N, kLeastForce_N);
  in.offset_W =
      lag_m > step_m && !ablated(Mechanism::kPointLag) ? (1 - step_m / lag_m) * lag_W : old.transition.offset_W;
  in.slope_W += old.transition.slope_W - old.received.slope_W;
  in.nhat_W = glm::normalize(in.nhat_W + old.transition.nhat_W - old.received.contact.nhat_ST_W);
  in.recess_m = old.transition.recess_m;
  in.most_m = old.transition.most_m;
  now.no_room_m = old.no_room_m;
  if (!now.received.is_from_tiles()) now.kept = old.kept;
  now.seen = old.seen;
  now.seen.see(way_of_tool(old.received.X0_WT, now.received.X0_WT),
               now.received.contact.gradient - old.received.contact.gradient);
  now.friction = old.friction;
  contact::turn_to(now.friction, in.nhat_W);

  const spatial::Pose& X0_WT = now.received.X0_WT;
  const double way_m =
      glm::distance(X0_WT.p + old.sample(X0_WT).p_ToC_W, old.received.contact.p_WC_W + old.transition.offset_W);
  const double free_N = kFreeStep_N / others;
  const double less_m = kSurprisePerWay * way_m + free_N / std::max(stiffness, kLeastForce_N);
  const double more_m = tank_level_J > 0 ? less_m : kSurprisePerWay * way_m;
  // One that has become stiffer pushes as it did; the rest is let in.
  const double base_m = promised_m * std::min(1.0, old.stiffness_N_per_m() / std::max(stiffness, kLeastForce_N));
  now.look_from(X_WT);
  const double found_m = now.felt_m();
  const double room_J = std::max(0.0, kSurprise_J + tank_level_J);
  const double paid_m = std::sqrt(2 * (old.energy_J(promised_m) + room_J) / std::max(stiffness, kLeastForce_N));
  const double felt_m =
      ablated(Mechanism::kSurprises)
          ? found_m
          : std::clamp(found_m, std::max(0.0, base_m - less_m), std::max(base_m, std::min(base_m + more_m, paid_m)));
  if (felt_m != found_m) in.recess_m = now.here.depth_m - felt_m;
  contact::slide(now.friction, now.friction_limits(felt_m), glm::dvec3(0));
  return before_J - now.energy_with_friction_J(felt_m);
}

void WarmStart::add(const FeltContact& old) noexcept {
  const double felt_m = old.felt_m(), N = old.stiffness_N_per_m() * felt_m;
  const contact::FrictionLimits limits = old.friction_limits(felt_m);
  force_N += N;
  p_sum += N * old.here.p_ToC_W;
  nhat_sum += N * old.transition.nhat_W;
  slope_sum += N * (old.transition.slope_W + old.here.bend_slope_W);
  friction_N += limits.stiffness_N_per_m * old.friction.stretch_W;
  friction_J += contact::friction_energy_J(old.friction, limits);
  is_sliding = is_sliding || old.friction.is_sliding;
  if (N > strongest_N) strongest_N = N, seen = old.seen;
}

contact::Friction WarmStart::friction(const glm::dvec3& nhat, const contact::FrictionLimits& limits) const noexcept {
  const double k = limits.stiffness_N_per_m, held_N = glm::length(friction_N);
  if (!(k > 0) || !(held_N > 0)) return {};
  const double stretch_m = std::min(held_N / k, std::sqrt(2 * friction_J / k));
  contact::Friction successor{stretch_m / held_N * friction_N, is_sliding};
  contact::turn_to(successor, nhat);
  contact::slide(successor, limits, glm::dvec3(0));
  return successor;
}

double begin(FeltContact& felt, const WarmStart& before, double since_s, std::size_t count_before, std::size_t count,
             const spatial::Pose& X_WT) noexcept {
  Transition& in = felt.transition;
  felt.look_from(X_WT);
  const double stiffness = felt.stiffness_N_per_m();
  if (stiffness <= 0) return 0;
  const double step_N = kFreeStep_N / static_cast<double>(count);
  felt.seen = before.seen;
  felt.no_room_m = before.no_room_m;
  const double wanted_N = stiffness * std::max(0.0, felt.here.depth_m - felt.no_room_m);
  if (before.force_N > 0) {
    const glm::dquat turn_back = felt.received.X0_WT.R * glm::conjugate(X_WT.R);
    in.offset_W = turn_back * (before.p_sum / before.force_N - felt.here.p_ToC_W);
    in.nhat_W = glm::normalize(before.nhat_sum);
    in.slope_W = before.slope_sum / before.force_N;
    felt.look_from(X_WT);
    if (felt.received.is_bent()) {
      in.slope_W -= felt.here.bend_slope_W;
      felt.look_from(X_WT);
    }
    in.recess_m = felt.here.depth_m - before.force_N / stiffness;  // as deep as the force says
    follow(felt, 0, count_before, X_WT);
  }
  const double depth_m = felt.here.depth_m;
  const double news = share_after(since_s, felt.received.origin.news_s);
  const double felt_N = before.force_N + std::clamp(news * (wanted_N - before.force_N), -step_N, step_N);
  in.recess_m = felt_N > 0 ? depth_m - felt_N / stiffness : std::max(0.0, depth_m);
  const contact::FrictionLimits limits = felt.friction_limits(std::max(0.0, felt_N / stiffness));
  felt.friction = before.friction(in.nhat_W, limits);
  return contact::friction_energy_J(felt.friction, limits);
}

}  // namespace farfeel::local_model
