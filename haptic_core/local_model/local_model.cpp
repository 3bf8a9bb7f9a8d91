// Energy. Stored: U = sum of k felt^2 / 2, and friction's springs. Four things change it:
//   an object moves    by its script, with the tool: its part of dU and of what dampers and friction take is the
//                      script's (settle); so is what it came otherwise than foreseen (go_along)
//   the tool moves     the work w it puts in is stored or dissipated; w - dU goes to the tank (settle)
//   an update          dU > 0 is taken from the tank, or the update is shrunk; dU < 0 is given to it (model_update.cpp)
//                      That holds whatever the remote did: what patches that it made anew change is part of dU here,
//                      and paid with it, once
//   letting in and go  the same, a little every tick (advance)
// So the contact port never gives more than it got, plus the tank's stated allowance.
#include "haptic_core/local_model/local_model.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/local_model/constants.h"

namespace farfeel::local_model {

using spatial::Vector6;

namespace {

/// Of contacts from tiles: how much of their push is the mean of a step. `at`: of each contact.
double mean_share(std::span<const FeltContact> contacts, std::span<const FeltContact::Sample> at,
                  const motion::MovingObjects* moving, const spatial::Twist& V_WT_W, double tool_mass_kg, double dt_s) {
  if (ablated(Mechanism::kAmidStep)) return 0;
  double stiffest_N_per_m = 0, way_m = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (moving && moving->find(contacts[i].received.contact.object)) return 0;
    const double stiffness = contacts[i].stiffness_N_per_m();
    const double turning = contacts[i].seen.whole_N_per_m(stiffness * contacts[i].felt_m(at[i]));
    stiffest_N_per_m = std::max({stiffest_N_per_m, stiffness, turning});
    way_m = std::max(way_m, dt_s * glm::length(spatial::velocity_at(V_WT_W, at[i].p_ToC_W)));
  }
  const double is_held = std::clamp(2 - 2 * stiffest_N_per_m / held_without_N_per_m(tool_mass_kg, dt_s), 0.0, 1.0);
  return is_held * std::clamp(way_m / kStillWay_m - 1, 0.0, 1.0);
}

}  // namespace

LocalModel::LocalModel(const LocalModelSettings& settings) : settings_(settings), tank_(settings.tank) {}

Freshness LocalModel::freshness() const noexcept {
  if (!news_.has_heard()) return Freshness::kNone;
  if (news_.excess_s() > kFadingAfter_s) return Freshness::kExpired;
  return news_.excess_s() > kHeldAfter_s ? Freshness::kHeld : Freshness::kFresh;
}

/// Samples every contact at a tool pose, where that is not the pose of the call before.
void LocalModel::look_from(const spatial::Pose& X_WT) noexcept {
  if (X_WT_.R == X_WT.R && X_WT_.p == X_WT.p) return;
  X_WT_ = X_WT;
  for (std::size_t i = 0; i < count_; ++i) contacts_[i].look_from(X_WT);
}

FeltContact::Sample LocalModel::sample(const FeltContact& felt, const spatial::Pose& X_WT) const noexcept {
  return X_WT_.R == X_WT.R && X_WT_.p == X_WT.p ? felt.here : felt.sample(X_WT);
}

double LocalModel::stored_energy_J() const noexcept {
  if (has_rows()) return stored_J_;  // the pad's changes in steps only
  double energy_J = 0;
  for (std::size_t i = 0; i < count_; ++i) energy_J += contacts_[i].energy_with_friction_J(contacts_[i].felt_m());
  return energy_J;
}

double LocalModel::wrench_share() const noexcept {
  if (!news_.has_heard()) return 0;
  return std::clamp(1 - (news_.excess_s() - kHeldAfter_s) / (kFadingAfter_s - kHeldAfter_s), 0.0, 1.0);
}

/// Of the contact's object at To; zero where it stands still.
Vector6 LocalModel::surface_twist(const FeltContact& felt, const glm::dvec3& p_WTo) const noexcept {
  const motion::Moved* moved = moving_ ? moving_->find(felt.received.contact.object) : nullptr;
  return moved ? spatial::to_vector6(moved->twist_at(p_WTo)) : Vector6::Zero();
}

void LocalModel::go_along(const motion::MovingObjects& objects, const spatial::Pose& X_WT) noexcept {
  moving_ = &objects;
  if (objects.moved().empty()) return;
  look_from(X_WT);
  for (std::size_t i = 0; i < count_; ++i) {
    FeltContact& felt = contacts_[i];
    const motion::Moved* moved = objects.find(felt.received.contact.object);
    if (!moved) continue;
    // What was taken away pushes no more: it is let go like a contact that nobody replaces.
    if (!moved->is_there) felt.transition.is_leaving = true;
    const spatial::Pose way_W = moved->way_W * spatial::inverse(felt.foreseen_W);
    felt.foreseen_W = {};
    felt.go_along(way_W);
    felt.look_from(X_WT);
    if (has_rows()) continue;
    const glm::dvec3 p_WC = X_WT.p + felt.here.p_ToC_W, came_W = spatial::transform_point(way_W, p_WC) - p_WC;
    contact::slide(felt.friction, felt.friction_limits(felt.felt_m()), across(-came_W, felt.transition.nhat_W));
  }
  const double stored_J = stored_energy_J();
  script_work_J_ += stored_J - stored_J_;
  stored_J_ = stored_J;
}

/// Moves felt depths towards those received, as far as time and tank allow. What the tank lacks they lack alike: paid
/// in turn, the first would get all of it, and tilt the tool.
void LocalModel::let_in_all(double dt_s, const spatial::Pose& X_WT) noexcept {
  std::array<LetIn, kMaxFelt> wanted;
  double owed_J = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    if (contacts_[i].transition.is_leaving) continue;
    wanted[i] = to_let_in(contacts_[i], dt_s, count_, X_WT);
    give(wanted[i].gives_J);
    owed_J += std::max(0.0, wanted[i].costs_J);
    give(std::max(0.0, -wanted[i].costs_J));
  }
  const bool in_turn = ablated(Mechanism::kTankSharing);
  double share = owed_J > 0 && !in_turn ? pay(owed_J) / owed_J : 1;
  for (std::size_t i = 0; i < count_; ++i) {
    if (contacts_[i].transition.is_leaving) continue;
    if (in_turn && wanted[i].costs_J > 0) share = pay(wanted[i].costs_J) / wanted[i].costs_J;
    let_in(contacts_[i], wanted[i], share);
  }
}

void LocalModel::advance(double dt_s, const spatial::Pose& X_WT) noexcept {
  look_from(X_WT);
  news_.pass(dt_s);
  tick_s_ = dt_s;
  tank_.pass(dt_s);
  const bool is_expired = freshness() == Freshness::kExpired;
  std::size_t leaving = 0;
  for (std::size_t i = 0; i < count_; ++i) leaving += contacts_[i].transition.is_leaving;
  if (!is_expired) {
    for (std::size_t i = 0; i < count_; ++i)
      if (!contacts_[i].transition.is_leaving) follow(contacts_[i], dt_s, count_, X_WT);
    let_in_all(dt_s, X_WT);
  }
  std::size_t stay = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    FeltContact& felt = contacts_[i];
    if (felt.transition.is_leaving || is_expired) {
      const LetGo gone = felt.transition.is_leaving ? leave(felt, dt_s, leaving) : fade(felt, dt_s, count_);
      give(gone.gives_J);
      if (gone.is_gone) continue;
    } else {
      contact::slide(felt.friction, felt.friction_limits(felt.felt_m()), glm::dvec3(0));
    }
    if (stay != i) contacts_[stay] = felt;
    ++stay;
  }
  count_ = stay;
  stored_J_ = stored_energy_J();
}

double LocalModel::ahead_s(const spatial::Pose& X_WT, const spatial::Twist& V_WT_W, double dt_s) const noexcept {
  if (has_rows()) return 0;  // where_to_look() says it
  std::array<FeltContact::Sample, kMaxFelt> at;
  for (std::size_t i = 0; i < count_; ++i) at[i] = sample(contacts_[i], X_WT);
  const std::span contacts(contacts_.data(), count_);
  return 0.5 * dt_s * mean_share(contacts, at, moving_, V_WT_W, settings_.tool_mass_kg, dt_s);
}

Felt LocalModel::evaluate(const spatial::Pose& X_WT, const spatial::Twist& V_WT_W, double dt_s) const noexcept {
  Felt felt;
  const Vector6 V = spatial::to_vector6(V_WT_W);
  double rates_squared = 0;  // of the pressing contacts' depths [m^2/s^2]
  std::array<FeltContact::Sample, kMaxFelt> at;
  for (std::size_t i = 0; i < count_; ++i) {
    at[i] = sample(contacts_[i], X_WT);
    felt.depth_max_m = std::max(felt.depth_max_m, at[i].depth_m);
    if (contacts_[i].felt_m(at[i]) <= 0) continue;
    const double rate_m_s = at[i].gradient.dot(V - surface_twist(contacts_[i], X_WT.p));
    rates_squared += rate_m_s * rate_m_s;
    ++felt.pressing;
  }
  if (settings_.rung == Rung::kHeldWrench) {
    felt.response.F_To_W = wrench_share() * spatial::to_vector6(held_F_To_W_);
    return felt;
  }

  const std::span contacts(contacts_.data(), count_);
  Step step{.X_WT = X_WT, .V_WT_W = V, .dt_s = dt_s, .tool_mass_kg = settings_.tool_mass_kg};
  step.mean_share = mean_share(contacts, at, moving_, V_WT_W, settings_.tool_mass_kg, dt_s);
  // A debt of the tank is what the linearisation gave by mistake: it is paid back as damping.
  const double debt_J = std::max(0.0, -tank_.level_J());
  if (rates_squared > 0 && !ablated(Mechanism::kPayback))
    step.payback_Ns_per_m = std::min(kMaxPaybackDamping_Ns_per_m, debt_J / (dt_s * rates_squared));
  for (std::size_t i = 0; i < count_; ++i)
    add_response(felt, contacts[i], at[i], surface_twist(contacts[i], X_WT.p), step);
  felt.step = step;
  return felt;
}

/// Each alone, as evaluate() added them up: the step's linearisation is a sum, and so is what it applied.
void LocalModel::tell_pushes(const Felt& felt, const tool::StepWork& stepped, Pushes& out) const noexcept {
  out.count = 0;
  if (settings_.rung == Rung::kHeldWrench) return;
  for (std::size_t i = 0; i < count_ && out.count < out.of.size(); ++i) {
    const FeltContact& contact = contacts_[i];
    const FeltContact::Sample at = sample(contact, felt.step.X_WT);
    Felt alone;
    add_response(alone, contact, at, surface_twist(contact, felt.step.X_WT.p), felt.step);
    const glm::dvec3 force_N =
        spatial::wrench_from(tool::applied_wrench(alone.response, stepped, felt.step.dt_s)).force_N;
    if (force_N == glm::dvec3(0)) continue;
    out.of[out.count++] = {contact.received.contact.object,
                           glm::vec3(felt.step.X_WT.p + at.p_ToC_W),
                           glm::vec3(contact.transition.nhat_W),
                           glm::vec3(force_N),
                           static_cast<float>(contact.felt_m(at)),
                           static_cast<std::uint8_t>(contact.received.contact.doubts & contact::kAllDoubts),
                           contact.received.origin.source,
                           contact.transition.is_leaving};
  }
}

/// The tool has moved with V for dt to X_WT; the object will have moved too by the next tick, and the contact goes
/// along already: first the one's motion and then the other's would press and slide where both together hardly do.
/// Returns the work of the object's part, each part's being the mean over both orders.
double LocalModel::go_on_moving(FeltContact& felt, const motion::Moved& object, const Vector6& V_WT_W, double dt_s,
                                const spatial::Pose& X_WT) noexcept {
  const spatial::Pose X_WT_before = spatial::integrate(X_WT, spatial::twist_from(V_WT_W), -dt_s);
  const FeltContact::Sample begun = felt.sample(X_WT_before), tool_moved = felt.sample(X_WT);
  felt.foreseen_W = spatial::integrate({}, object.V_Wo_W, dt_s);
  felt.go_along(felt.foreseen_W);
  felt.look_from(X_WT);
  const FeltContact::Sample object_moved = felt.sample(X_WT_before), &ended = felt.here;
  if (!felt.received.is_from_tiles())
    felt.seen.see(dt_s * (V_WT_W - spatial::to_vector6(object.twist_at(X_WT.p))), ended.gradient - begun.gradient);
  const auto energy_J = [&](const FeltContact::Sample& at) { return felt.energy_J(felt.felt_m(at)); };
  double work_J = 0.5 * (energy_J(object_moved) - energy_J(begun) + energy_J(ended) - energy_J(tool_moved));

  const double surface_rate_m_s = ended.gradient.dot(spatial::to_vector6(object.twist_at(X_WT.p)));
  const double rate_m_s = ended.gradient.dot(V_WT_W) - surface_rate_m_s;
  const double spring_N = felt.stiffness_N_per_m() * felt.felt_m();
  work_J -= std::clamp(damping_Ns_per_m(felt, settings_.tool_mass_kg) * rate_m_s, -spring_N, spring_N) *
            surface_rate_m_s * dt_s;

  const contact::FrictionLimits limits = felt.friction_limits(felt.felt_m());
  // The tool's place that pushes now, not the way of the contact point, which jumps where a line rocks.
  const glm::dvec3 p_TC_T = glm::conjugate(X_WT.R) * ended.p_ToC_W;
  const glm::dvec3 from_W = spatial::transform_point(X_WT_before, p_TC_T),
                   went_W = spatial::transform_point(felt.foreseen_W, from_W);
  const glm::dvec3 stretch_before_W = felt.friction.stretch_W;
  contact::slide(felt.friction, limits, across(X_WT.p + ended.p_ToC_W - went_W, felt.transition.nhat_W));
  return work_J -
         0.5 * limits.stiffness_N_per_m * glm::dot(stretch_before_W + felt.friction.stretch_W, went_W - from_W);
}

void LocalModel::settle(const Vector6& applied_F_To_W, const Vector6& V_WT_W, double dt_s,
                        const spatial::Pose& X_WT) noexcept {
  const double work_J = -applied_F_To_W.dot(V_WT_W) * dt_s;
  port_.add(work_J);
  const spatial::Twist moved = spatial::twist_from(dt_s * V_WT_W);
  const spatial::Pose X_WT_before = spatial::integrate(X_WT, spatial::twist_from(V_WT_W), -dt_s);
  double script_J = 0;
  X_WT_ = X_WT;
  for (std::size_t i = 0; i < count_; ++i) {
    FeltContact& felt = contacts_[i];
    if (const motion::Moved* object = moving_ ? moving_->find(felt.received.contact.object) : nullptr) {
      script_J += go_on_moving(felt, *object, V_WT_W, dt_s, X_WT);
      continue;
    }
    // A linearised contact's gradient turns where its lateral range ends: a step that does not know it throws a light
    // tool over that edge, stores more there than the tool gave, and does so for ever.
    const bool is_from_tiles = felt.received.is_from_tiles();
    const Vector6 gradient_before = is_from_tiles ? Vector6(Vector6::Zero()) : felt.sample(X_WT_before).gradient;
    felt.look_from(X_WT);
    if (!is_from_tiles) felt.seen.see(dt_s * V_WT_W, felt.here.gradient - gradient_before);
    contact::slide(felt.friction, felt.friction_limits(felt.felt_m()),
                   across(spatial::velocity_at(moved, felt.here.p_ToC_W), felt.transition.nhat_W));
  }
  const double stored_J = stored_energy_J();
  if (settings_.rung != Rung::kHeldWrench) tank_.add(work_J + script_J - (stored_J - stored_J_));
  script_work_J_ += script_J;
  stored_J_ = stored_J;
}

}  // namespace farfeel::local_model
