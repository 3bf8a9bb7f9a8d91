// Energy. Stored: U = sum of k felt^2 / 2, and friction's springs. Four things change it:
//   an object moves    by its script, with the tool: its part of dU and of what dampers and friction take is the
//                      script's (settle); so is what it came otherwise than foreseen (go_along)
//   the tool moves     the work w it puts in is stored or dissipated; w - dU goes to the tank (settle)
//   an update          dU > 0 is taken from the tank, or the update is shrunk; dU < 0 is given to it (model_update.cpp)
//                      That holds whatever the remote did: what its clusters' hand-over made there (StageTimes::made_J)
//                      is part of dU here, and paid with it, once
//   letting in and go  the same, a little every tick (advance)
// So the contact port never gives more than it got, plus the tank's stated allowance.
#include "haptic_core/local_model/local_model.h"

#include <algorithm>
#include <cmath>

namespace farfeel::local_model {
namespace {

using spatial::Matrix6;
using spatial::Vector6;

constexpr double kMaxDepth_m = 1.0;            // more is not a contact but an error
constexpr double kMaxStiffness_N_per_m = 1e6;  // far stiffer than any device renders
constexpr double kMaxGradient = 1e15;      // steep walls have any slope (felt_contact.h bounds it); more is an overflow
constexpr double kSamePointSnap_m = 2e-4;  // below, a moved contact point is taken over at once
constexpr double kSameDirectionSnap_rad = 0.005;  // the same for its direction
constexpr double kLeaving = 1.5;                  // times bleed_s: time constant of a contact that is gone
constexpr double kSlowestFade = 0.4;              // of fade_s: time constant of a force however deep a hand sinks
constexpr double kGone = 1e-3;                    // share of a stiffness that is no longer felt as it leaves
constexpr double kMaxPaybackDamping_Ns_per_m = 5;
constexpr double kStillWay_m = 4e-6;  // less way in a tick is rest, where damping counts; twice as much is a stroke
constexpr double kLeastChange_N = 1e-12;
/// Of critical damping, of the tool on a contact that old answers tell of. They answer its swing when that is over, as
/// if it were a swing of its own; with the contact's own damping alone it would go on for ever.
constexpr double kDampedWhenOld = 0.25;
constexpr double kHeldOfMass = 0.25;  // k of m / dt^2 that a step holds without knowing it; all is lost from 4 on

glm::dvec3 across(const glm::dvec3& v, const glm::dvec3& nhat) {
  return v - glm::dot(v, nhat) * nhat;
}

}  // namespace

LocalModel::LocalModel(const LocalModelSettings& settings) : settings_(settings), tank_(settings.tank) {}

Freshness LocalModel::freshness() const noexcept {
  if (!news_.has_heard()) return Freshness::kNone;
  if (news_.excess_s() > settings_.fading_after_s) return Freshness::kExpired;
  return news_.excess_s() > settings_.held_after_s ? Freshness::kHeld : Freshness::kFresh;
}

double LocalModel::stored_energy_J(const spatial::Pose& X_WT) const noexcept {
  double energy_J = 0;
  for (std::size_t i = 0; i < count_; ++i)
    energy_J += contacts_[i].energy_with_friction_J(contacts_[i].sample(X_WT).felt_m);
  return energy_J;
}

double LocalModel::wrench_share() const noexcept {
  if (!news_.has_heard()) return 0;
  const double fading_s = settings_.fading_after_s - settings_.held_after_s;
  return std::clamp(1 - (news_.excess_s() - settings_.held_after_s) / fading_s, 0.0, 1.0);
}

/// Of the contact's object at To; zero where it stands still.
Vector6 LocalModel::surface_twist(const FeltContact& felt, const glm::dvec3& p_WTo) const noexcept {
  const motion::Moved* moved = moving_ ? moving_->find(felt.at_X0.object) : nullptr;
  return moved ? spatial::to_vector6(moved->twist_at(p_WTo)) : Vector6::Zero();
}

void LocalModel::go_along(const motion::MovingObjects& objects, const spatial::Pose& X_WT) noexcept {
  moving_ = &objects;
  if (objects.moved().empty()) return;
  for (std::size_t i = 0; i < count_; ++i) {
    FeltContact& felt = contacts_[i];
    const motion::Moved* moved = objects.find(felt.at_X0.object);
    if (!moved) continue;
    const spatial::Pose way_W = moved->way_W * spatial::inverse(felt.foreseen_W);
    felt.foreseen_W = {};
    felt.go_along(way_W);
    const FeltContact::Sample sample = felt.sample(X_WT);
    const glm::dvec3 p_WC = X_WT.p + sample.p_ToC_W, came_W = spatial::transform_point(way_W, p_WC) - p_WC;
    contact::slide(felt.friction, felt.friction_limits(sample.felt_m), across(-came_W, felt.nhat_W));
  }
  const double stored_J = stored_energy_J(X_WT);
  script_work_J_ += stored_J - stored_J_;
  stored_J_ = stored_J;
}

/// Turns the direction and the slope and moves the point towards what was received, at constant stored energy.
void LocalModel::follow(FeltContact& felt, double dt_s, const spatial::Pose& X_WT) noexcept {
  const double cosine = glm::dot(felt.nhat_W, felt.at_X0.nhat_ST_W);
  const double offset_m = glm::length(felt.offset_W);
  const glm::dvec3 slope_left = felt.slope_goal_W - felt.slope_W;
  const double slope_left_length = glm::length(slope_left);
  if (cosine >= 1 - 1e-14 && offset_m == 0 && slope_left_length == 0) return;
  const double felt_m = felt.sample(X_WT).felt_m;
  const double force_N = felt.stiffness_N_per_m() * felt_m;
  const double step_N = settings_.slope_step_N / std::max<double>(1, static_cast<double>(count_));
  const double slope_share =
      std::min(share_after(dt_s, felt.news_s), step_N / std::max(force_N * slope_left_length, kLeastChange_N));
  felt.slope_W = slope_share < 1 ? felt.slope_W + slope_share * slope_left : felt.slope_goal_W;
  const double bleed_s = std::max(settings_.bleed_s, felt.news_s), share = share_after(dt_s, bleed_s);
  const double snap = std::pow(settings_.bleed_s / bleed_s, 2);  // what snaps is not slow
  felt.offset_W *= offset_m < snap * kSamePointSnap_m ? 0.0 : 1 - share;
  const double angle_rad = std::acos(std::clamp(cosine, -1.0, 1.0));
  felt.nhat_W = angle_rad < snap * kSameDirectionSnap_rad
                    ? felt.at_X0.nhat_ST_W
                    : glm::normalize(glm::mix(felt.nhat_W, felt.at_X0.nhat_ST_W, share));
  contact::turn_to(felt.friction, felt.nhat_W);
  if (felt_m > 0) felt.recess_m = felt.sample(X_WT).depth_m - felt_m;
}

/// What is let go, whose recess is below its goal, grows no deeper while the tool approaches a surface that it does not
/// touch yet.
void LocalModel::hold_back(FeltContact& felt, double goal_m, const spatial::Pose& X_WT) noexcept {
  if (!(felt.recess_m < goal_m)) {
    felt.most_m = std::numeric_limits<double>::infinity();
    return;
  }
  const FeltContact::Sample sample = felt.sample(X_WT);
  const double most_m = std::max({0.0, sample.depth_m - goal_m, felt.most_m});
  if (sample.felt_m > most_m) {
    felt.recess_m = sample.depth_m - most_m;
    tank_.add(felt.energy_J(sample.felt_m) - felt.energy_J(most_m));
  }
  felt.most_m = std::min(sample.felt_m, most_m);
}

/// By slopes that lag behind, the depth would still swing as the tool did when it was told: so it is let in towards the
/// one of the linearisation as received.
LocalModel::LetIn LocalModel::to_let_in(FeltContact& felt, double dt_s, const spatial::Pose& X_WT) noexcept {
  const double goal_m = felt.beyond_told_m(X_WT);  // of the recess
  hold_back(felt, goal_m, X_WT);
  if (felt.recess_m == goal_m) return {};
  const FeltContact::Sample sample = felt.sample(X_WT);
  if (sample.felt_m == 0) {  // nothing is stored: what is owed shrinks to what would be felt, at no cost
    felt.recess_m = std::max(goal_m, sample.depth_m);
    if (felt.recess_m == goal_m) return {};
  }
  constexpr double kDone_m = 1e-8;
  const double left_m = felt.recess_m - goal_m;
  double change_m = left_m * share_after(dt_s, settings_.bleed_s);
  if (std::abs(left_m) < kDone_m) change_m = left_m;
  const double fastest_N = settings_.bleed_N_per_s * dt_s / static_cast<double>(count_);
  if (felt.stiffness_N_per_m() > 0) {
    const double fastest_m = fastest_N / felt.stiffness_N_per_m();
    change_m = std::clamp(change_m, -fastest_m, fastest_m);
  }
  const double ends_m = std::max(0.0, sample.felt_m + change_m);
  return {sample.felt_m, change_m, felt.energy_J(ends_m) - felt.energy_J(sample.felt_m)};
}

/// Moves felt depths towards those received, as far as time and tank allow. What the tank lacks they lack alike: paid
/// in turn, the first would get all of it, and tilt the tool.
void LocalModel::let_in(double dt_s, const spatial::Pose& X_WT) noexcept {
  std::array<LetIn, kMaxFelt> wanted;
  double owed_J = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    if (contacts_[i].is_leaving) continue;
    wanted[i] = to_let_in(contacts_[i], dt_s, X_WT);
    owed_J += std::max(0.0, wanted[i].costs_J);
    tank_.add(std::max(0.0, -wanted[i].costs_J));
  }
  const double share = owed_J > 0 ? tank_.take(owed_J) / owed_J : 1;
  for (std::size_t i = 0; i < count_; ++i) {
    FeltContact& felt = contacts_[i];
    if (felt.is_leaving) continue;
    LetIn& in = wanted[i];
    if (in.costs_J > 0 && share < 1) {
      const double ends_J = felt.energy_J(in.felt_m) + share * in.costs_J;
      in.change_m = std::sqrt(2 * ends_J / felt.stiffness_N_per_m()) - in.felt_m;
    }
    felt.recess_m -= in.change_m;
  }
}

void LocalModel::advance(double dt_s, const spatial::Pose& X_WT) noexcept {
  news_.pass(dt_s);
  tick_s_ = dt_s;
  tank_.pass(dt_s);
  const bool is_expired = freshness() == Freshness::kExpired;
  const auto leaving =
      static_cast<double>(std::count_if(contacts_.begin(), contacts_.begin() + static_cast<std::ptrdiff_t>(count_),
                                        [](const FeltContact& felt) { return felt.is_leaving; }));
  if (!is_expired) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (!contacts_[i].is_leaving) follow(contacts_[i], dt_s, X_WT);
    }
    let_in(dt_s, X_WT);
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    FeltContact& felt = contacts_[i];
    if (felt.is_leaving || is_expired) {
      double felt_m = felt.sample(X_WT).felt_m;
      const double before_J = felt.energy_with_friction_J(felt_m);
      // What is gone decays, and grows no deeper: its surface, drawn on as a plane, may lie across the tool's way. What
      // is only old goes to zero in a stated time.
      if (felt.is_leaving) {
        const double pushed_N = leaving * felt.stiffness_N_per_m() * felt_m;  // with what the last step sank in
        felt.recess_m += std::max(0.0, felt_m - felt.most_m);
        felt_m = felt.most_m = std::min(felt_m, felt.most_m);
        felt.share *= std::exp(-dt_s / (kLeaving * settings_.bleed_s));
        if (pushed_N < settings_.soon_gone_N)
          felt.share *= std::max(0.0, 1 - settings_.leave_N_per_s * dt_s / pushed_N);
      } else {
        // A hand that is let go sinks deeper and deeper: the last of a stiffness would be as much force as the first.
        const double whole_N = static_cast<double>(count_) * felt.at_X0.material.stiffness_N_per_m * felt_m;
        const double calm_per_s = settings_.leave_N_per_s / std::max(whole_N, 1e-9);
        const double slowest_per_s = felt.share / (kSlowestFade * settings_.fade_s);
        felt.share -= dt_s * std::min(std::max(calm_per_s, slowest_per_s), 1 / settings_.fade_s);
      }
      if (felt.share <= 0 || (felt.is_leaving && (felt.share <= kGone || felt_m == 0))) {
        tank_.add(before_J);
        continue;
      }
      contact::slide(felt.friction, felt.friction_limits(felt_m), glm::dvec3(0));
      tank_.add(before_J - felt.energy_with_friction_J(felt_m));
    } else {
      contact::slide(felt.friction, felt.friction_limits(felt.sample(X_WT).felt_m), glm::dvec3(0));
    }
    if (kept != i) contacts_[kept] = felt;
    ++kept;
  }
  count_ = kept;
  stored_J_ = stored_energy_J(X_WT);
}

double LocalModel::damping_Ns_per_m(const FeltContact& felt) const noexcept {
  const double critical = 2 * std::sqrt(felt.stiffness_N_per_m() * settings_.tool_mass_kg);
  return felt.damping_Ns_per_m() + kDampedWhenOld * felt.news_s / kSlowestNews_s * critical;
}

double LocalModel::held_without_N_per_m(double dt_s) const noexcept {
  return kHeldOfMass * settings_.tool_mass_kg / (dt_s * dt_s);
}

double LocalModel::mean_share(const Samples& samples, const spatial::Twist& V_WT_W, double dt_s) const noexcept {
  double stiffest_N_per_m = 0, way_m = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    if (moving_ && moving_->find(contacts_[i].at_X0.object)) return 0;
    const double stiffness = contacts_[i].stiffness_N_per_m();
    const double turning = contacts_[i].seen.whole_N_per_m(stiffness * samples[i].felt_m);
    stiffest_N_per_m = std::max({stiffest_N_per_m, stiffness, turning});
    way_m = std::max(way_m, dt_s * glm::length(spatial::velocity_at(V_WT_W, samples[i].p_ToC_W)));
  }
  const double is_held = std::clamp(2 - 2 * stiffest_N_per_m / held_without_N_per_m(dt_s), 0.0, 1.0);
  return is_held * std::clamp(way_m / kStillWay_m - 1, 0.0, 1.0);
}

double LocalModel::ahead_s(const spatial::Pose& X_WT, const spatial::Twist& V_WT_W, double dt_s) const noexcept {
  Samples samples;
  for (std::size_t i = 0; i < count_; ++i) samples[i] = contacts_[i].sample(X_WT);
  return 0.5 * dt_s * mean_share(samples, V_WT_W, dt_s);
}

Felt LocalModel::evaluate(const spatial::Pose& X_WT, const spatial::Twist& V_WT_W, double dt_s) const noexcept {
  Felt felt;
  const Vector6 V = spatial::to_vector6(V_WT_W);
  double rates_squared = 0;  // of the pressing contacts' depths [m^2/s^2]
  Samples samples;
  std::array<double, kMaxFelt> rates_m_s{};  // of depths
  for (std::size_t i = 0; i < count_; ++i) {
    samples[i] = contacts_[i].sample(X_WT);
    rates_m_s[i] = samples[i].gradient.dot(V - surface_twist(contacts_[i], X_WT.p));
    felt.depth_max_m = std::max(felt.depth_max_m, samples[i].depth_m);
    if (samples[i].felt_m <= 0) continue;
    rates_squared += rates_m_s[i] * rates_m_s[i];
    ++felt.pressing;
  }
  if (settings_.rung == Rung::kHeldWrench) {
    felt.response.F_To_W = wrench_share() * spatial::to_vector6(held_F_To_W_);
    return felt;
  }

  // A debt of the tank is what the linearisation gave by mistake: it is paid back as damping.
  const double debt_J = std::max(0.0, -tank_.level_J());
  const double payback = rates_squared > 0 ? std::min(kMaxPaybackDamping_Ns_per_m, debt_J / (dt_s * rates_squared)) : 0;

  const double held_N_per_m = held_without_N_per_m(dt_s), tiles_mean = mean_share(samples, V_WT_W, dt_s);
  for (std::size_t i = 0; i < count_; ++i) {
    const FeltContact& contact = contacts_[i];
    const FeltContact::Sample& sample = samples[i];
    const Vector6& g = sample.gradient;
    const double stiffness = contact.stiffness_N_per_m();
    const Vector6 V_WS_W = surface_twist(contact, X_WT.p);
    const double surface_m = g.dot(V_WS_W) * dt_s;  // what its object takes off the depth within the step
    const double mean = contact.is_from_tiles ? tiles_mean : 0;
    const auto push = [&](const Matrix6& spring) {
      felt.response.by_pose -= (1 - mean) * spring;
      felt.response.mean_by_way -= 0.5 * mean * spring;
    };
    if (sample.felt_m <= 0) {
      // One that will touch within the step: its spring, written about the gap, pushes at the step's end with just the
      // depth it reaches, and as its mean with half of that. Left out, it would store energy that nobody put in.
      const double gap_m = sample.depth_m - contact.recess_m;
      if (gap_m + rates_m_s[i] * dt_s > 0) {
        felt.response.F_To_W -= stiffness * (1 - 0.5 * mean) * (gap_m - surface_m) * g;
        push(stiffness * g * g.transpose());
      }
      continue;
    }
    const double spring_N = stiffness * sample.felt_m;
    // Never pulls, continuous at touch; and implicit however much is clamped: held for a step, what a debt asks for
    // would throw a light tool back and make more debt.
    const double damping =
        std::min(damping_Ns_per_m(contact) + payback, spring_N / std::max(std::abs(rates_m_s[i]), 1e-12));
    const double damper_N = std::clamp(damping * rates_m_s[i], -spring_N, spring_N);
    felt.response.F_To_W -= (spring_N - stiffness * (1 - 0.5 * mean) * surface_m + damper_N) * g;
    push(stiffness * g * g.transpose());
    Matrix6 turning = contact.seen.beyond(spring_N, held_N_per_m);  // how the force turns with the way to its object
    if (contact.is_bent() || !contact.kept.is_empty()) turning += spring_N * contact.bend_at(X_WT);
    felt.response.by_pose -= turning;
    felt.response.F_To_W += dt_s * (turning * V_WS_W);
    felt.response.by_twist -= damping * g * g.transpose();
    felt.energy_J += contact.energy_J(sample.felt_m);
    felt.by_outline += contact.is_from_outline;
    felt.outline_off_m = std::max(felt.outline_off_m, contact.off_m);

    const contact::FrictionLimits limits = contact.friction_limits(sample.felt_m);
    const glm::dvec3 v_surface =
        across(spatial::velocity_at(spatial::twist_from(V_WS_W), sample.p_ToC_W), contact.nhat_W);
    const glm::dvec3 v_slide = across(spatial::velocity_at(V_WT_W, sample.p_ToC_W), contact.nhat_W) - v_surface;
    const contact::FrictionForce friction = contact::friction_force(contact.friction, limits, v_slide, dt_s);
    Eigen::Matrix<double, 3, 6> J;  // velocity of C across the direction, from the twist about To
    const Eigen::Vector3d n = spatial::to_eigen(contact.nhat_W);
    const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - n * n.transpose();
    J << -P * spatial::cross_matrix(sample.p_ToC_W), P;
    const Matrix6 JtJ = J.transpose() * J;
    felt.response.F_To_W +=
        J.transpose() * spatial::to_eigen(friction.force_W + friction.by_displacement_N_per_m * dt_s * v_surface);
    felt.response.by_pose -= friction.by_displacement_N_per_m * JtJ;
    felt.response.by_twist -= friction.by_velocity_Ns_per_m * JtJ;
    felt.energy_J += contact::friction_energy_J(contact.friction, limits);
  }
  return felt;
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
  const FeltContact::Sample object_moved = felt.sample(X_WT_before), ended = felt.sample(X_WT);
  if (!felt.is_from_tiles)
    felt.seen.see(dt_s * (V_WT_W - spatial::to_vector6(object.twist_at(X_WT.p))), ended.gradient - begun.gradient);
  const auto energy_J = [&](const FeltContact::Sample& at) { return felt.energy_J(at.felt_m); };
  double work_J = 0.5 * (energy_J(object_moved) - energy_J(begun) + energy_J(ended) - energy_J(tool_moved));

  const double surface_rate_m_s = ended.gradient.dot(spatial::to_vector6(object.twist_at(X_WT.p)));
  const double rate_m_s = ended.gradient.dot(V_WT_W) - surface_rate_m_s;
  const double spring_N = felt.stiffness_N_per_m() * ended.felt_m;
  work_J -= std::clamp(damping_Ns_per_m(felt) * rate_m_s, -spring_N, spring_N) * surface_rate_m_s * dt_s;

  const contact::FrictionLimits limits = felt.friction_limits(ended.felt_m);
  // The tool's place that pushes now, not the way of the contact point, which jumps where a line rocks.
  const glm::dvec3 p_TC_T = glm::conjugate(X_WT.R) * ended.p_ToC_W;
  const glm::dvec3 from_W = spatial::transform_point(X_WT_before, p_TC_T),
                   went_W = spatial::transform_point(felt.foreseen_W, from_W);
  const glm::dvec3 stretch_before_W = felt.friction.stretch_W;
  contact::slide(felt.friction, limits, across(X_WT.p + ended.p_ToC_W - went_W, felt.nhat_W));
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
  for (std::size_t i = 0; i < count_; ++i) {
    FeltContact& felt = contacts_[i];
    if (const motion::Moved* object = moving_ ? moving_->find(felt.at_X0.object) : nullptr) {
      script_J += go_on_moving(felt, *object, V_WT_W, dt_s, X_WT);
      continue;
    }
    // A linearised contact's gradient turns where its lateral range ends: a step that does not know it throws a light
    // tool over that edge, stores more there than the tool gave, and does so for ever.
    const Vector6 gradient_before = felt.is_from_tiles ? Vector6(Vector6::Zero()) : felt.sample(X_WT_before).gradient;
    const FeltContact::Sample sample = felt.sample(X_WT);
    if (!felt.is_from_tiles) felt.seen.see(dt_s * V_WT_W, sample.gradient - gradient_before);
    contact::slide(felt.friction, felt.friction_limits(sample.felt_m),
                   across(spatial::velocity_at(moved, sample.p_ToC_W), felt.nhat_W));
  }
  const double stored_J = stored_energy_J(X_WT);
  if (settings_.rung != Rung::kHeldWrench) tank_.add(work_J + script_J - (stored_J - stored_J_));
  script_work_J_ += script_J;
  stored_J_ = stored_J;
}

bool is_usable(const contact::ContactSet& set) noexcept {
  if (set.count > contact::kMaxContacts || !spatial::is_valid(set.X_WT) || !spatial::is_finite(set.F_To_W))
    return false;
  return std::all_of(set.contacts.begin(), set.contacts.begin() + set.count, [](const contact::Contact& contact) {
    const contact::Material& m = contact.material;
    const auto is_within = [](double value, double low, double high) { return value >= low && value <= high; };
    return spatial::is_finite(contact.p_WC_W) && std::abs(glm::length(contact.nhat_ST_W) - 1) <= 1e-3 &&
           is_within(contact.gradient.norm(), 0, kMaxGradient) &&
           is_within(contact.depth_m, -kMaxDepth_m, kMaxDepth_m) &&
           is_within(contact.lateral_range_m, 0, kMaxDepth_m) &&
           is_within(m.stiffness_N_per_m, 0, kMaxStiffness_N_per_m) && is_within(m.damping_Ns_per_m, 0, 1e4) &&
           is_within(m.static_friction, 0, 10) && is_within(m.dynamic_friction, 0, 10);
  });
}

}  // namespace farfeel::local_model
