#include "master_station/devices/host/limits_search.h"

#include <algorithm>
#include <cmath>

namespace farfeel::devices {
namespace {

constexpr double kTick_s = 1e-3;
constexpr std::int64_t kRest_ns = 100'000'000;   // without force before a trial, at least
constexpr std::int64_t kStill_ns = 50'000'000;   // and still for so long
constexpr std::int64_t kSwing_ns = 400'000'000;  // a trial at most: what died down is over
constexpr std::size_t kRestTicks = 40;           // a handle that stays so long does not swing any more
constexpr double kStill_m = 50e-6;               // a handle that a hand holds still moves less
constexpr double kSwingSteps = 5;                // of the encoder: smaller swings are more noise than swing
constexpr double kLeastSwing_m = 20e-6;

// Kicks. Their energies differ, so that the line of swing_fit.h has swings of different sizes.
constexpr std::array kEnergies_J{0.6e-3, 0.4e-3, 0.25e-3};
constexpr double kFirstImpulse_Ns = 0.6e-3;  // 9 uJ for 20 g
constexpr double kMostImpulse_Ns = 40e-3;    // kMostKick_N for kKickTicksMax
constexpr int kKickTicksMin = 3, kKickTicksMax = 20;
constexpr double kImpulseGrowth = 1.5, kImpulseFall = 0.5;  // from one trial to the next, at most
constexpr double kKickEnd_J = 0.75e-3;
constexpr double kEndOf = 0.95;  // of kMostGiven_J, with what is under way: the rest is for what that estimate misses

// Stiffness.
constexpr double kStiffer = 1.3;
constexpr double kFineEnough = 1.07;  // between what held and what did not
constexpr double kSoftest_N_per_m = 10;
constexpr int kTrialsMin = 6, kTrialsMax = 60;
constexpr double kSureErrors = 2;  // standard errors between r and 1
constexpr int kUnknownMax = 2;     // stiffer ones that cannot be told, after one that held

// A swing that outgrows the one before by this, twice in a trial, grows.
constexpr double kGrown = 1.04;
constexpr int kGrownMax = 2;

}  // namespace

std::string_view in_words(LimitsSearch::Outcome outcome) {
  switch (outcome) {
    case LimitsSearch::Outcome::kFound:
      return "found";
    case LimitsSearch::Outcome::kAllHeld:
      return "the stiffest that is tried held";
    case LimitsSearch::Outcome::kUnresolved:
      return "stiffer ones swing too little for the device's resolution";
    case LimitsSearch::Outcome::kNone:
      break;
  }
  return "nothing could be told: dry friction is stronger than the kicks, or nothing is calm";
}

LimitsSearch::LimitsSearch(const Settings& settings)
    : settings_(settings),
      most_delay_ticks_(
          std::min(static_cast<std::size_t>(std::lround((std::max(settings.delay_s, 0.0) + kDelayDoubt_s) / kTick_s)),
                   kForces - 1)),
      stiffness_N_per_m_(settings.first_N_per_m),
      fit_(settings.position_step_m),
      impulse_Ns_(kFirstImpulse_Ns),
      turns_(settings.position_step_m) {}

double LimitsSearch::least_swing_m() const {
  return std::max(kSwingSteps * settings_.position_step_m, kLeastSwing_m);
}

void LimitsSearch::rest(std::int64_t now_ns) {
  phase_ = Phase::kResting;
  phase_ns_ = still_ns_ = now_ns;
}

bool LimitsSearch::is_still(double position_m) {
  const double tremble_m = std::max(kStill_m, 2 * settings_.position_step_m);
  if (std::abs(position_m - rest_at_m_) < tremble_m) return true;
  rest_at_m_ = position_m;
  return false;
}

void LimitsSearch::begin_trial(std::int64_t now_ns, const Input& input) {
  phase_ = Phase::kKicked;
  phase_ns_ = now_ns;
  rest_at_m_ = last_m_ = input.position_m;
  given_J_ = most_given_J_ = 0;
  swings_grown_ = 0;
  forces_N_.fill(0);
  ledgers_J_.fill(0);
  turns_.clear();
  ++trials_;
  ++trials_here_;
  const double direction = trials_ % 2 == 0 ? 1 : -1;
  kick_ticks_ =
      std::clamp(static_cast<int>(std::ceil(impulse_Ns_ / (kMostKick_N * kTick_s))), kKickTicksMin, kKickTicksMax);
  kick_N_ = direction * std::min(impulse_Ns_ / (kick_ticks_ * kTick_s), kMostKick_N);
  kick_tick_ = 0;
}

/// What the forces that were sent, and are not seen in a movement yet, give at the speed it has now.
double LimitsSearch::under_way_J(const Input& input) const {
  double sum_J = 0;
  for (std::size_t i = 0; i <= most_delay_ticks_; ++i)
    sum_J += std::max(forces_N_[(tick_ + kForces - i) % kForces] * input.velocity_m_s, 0.0) * kTick_s;
  return sum_J;
}

double LimitsSearch::step(std::int64_t now_ns, const Input& input) {
  if (outcome_) return 0;
  if (!input.may_push || !std::isfinite(input.position_m) || !std::isfinite(input.velocity_m_s)) {
    if (phase_ != Phase::kResting) --trials_here_;  // it tells nothing
    rest(now_ns);
    return 0;
  }
  if (phase_ == Phase::kResting) {
    if (!is_still(input.position_m)) still_ns_ = now_ns;
    if (now_ns - phase_ns_ < kRest_ns || now_ns - still_ns_ < kStill_ns) return 0;
    begin_trial(now_ns, input);
  }

  // The ledgers: the force that was at work over the last movement, times that movement. Which force that was, only the
  // device's delay says.
  given_J_ = 0;
  for (std::size_t delay = 0; delay <= most_delay_ticks_; ++delay) {
    ledgers_J_[delay] += forces_N_[(tick_ + kForces - delay) % kForces] * (input.position_m - last_m_);
    given_J_ = std::max(given_J_, ledgers_J_[delay]);
  }
  last_m_ = input.position_m;
  most_given_J_ = std::max(most_given_J_, given_J_);
  const double soon_J = given_J_ + under_way_J(input);

  if (phase_ == Phase::kKicked && (kick_tick_ >= kick_ticks_ || soon_J > kKickEnd_J)) {
    phase_ = Phase::kSwinging;
    free_from_ = turns_.positions_m().size() + most_delay_ticks_ + 1;
  }
  if (turns_.add(input.position_m) && turns_.at().size() >= 3 && phase_ == Phase::kSwinging &&
      *(turns_.at().end() - 3) >= free_from_) {
    const auto at = turns_.at();
    const auto x = turns_.positions_m();
    const std::size_t n = at.size();
    const double before_m = std::abs(x[at[n - 2]] - x[at[n - 3]]), newest_m = std::abs(x[at[n - 1]] - x[at[n - 2]]);
    if (newest_m > kGrown * before_m + 2 * settings_.position_step_m) ++swings_grown_;
  }
  const bool rests =
      phase_ == Phase::kSwinging && turns_.positions_m().size() > free_from_ + kRestTicks && turns_.rests(kRestTicks);
  const bool is_over = rests || soon_J > kEndOf * kMostGiven_J || swings_grown_ >= kGrownMax ||
                       now_ns - phase_ns_ > kSwing_ns || std::abs(input.position_m - rest_at_m_) > kMostTravel_m;
  if (is_over) {
    end_trial(now_ns, rests);
    return 0;
  }
  double force_N =
      stiffness_N_per_m_ * (rest_at_m_ - input.position_m) - settings_.damping_Ns_per_m * input.velocity_m_s;
  if (phase_ == Phase::kKicked) {
    force_N += kick_N_;
    ++kick_tick_;
  }
  force_N = std::clamp(force_N, -kMostForce_N, kMostForce_N);
  tick_ = (tick_ + 1) % kForces;
  forces_N_[tick_] = force_N;
  return force_N;
}

void LimitsSearch::end_trial(std::int64_t now_ns, bool rests) {
  if (swings_grown_ >= kGrownMax) ++grown_here_;
  std::vector<double> stops_m = phase_ == Phase::kSwinging ? turns_.stops_m(free_from_, rests) : std::vector<double>{};
  for (double& stop_m : stops_m) stop_m -= rest_at_m_;
  fit_.add(stops_m, least_swing_m());
  // The next kick's impulse, from what this one gave: energy goes with its square.
  const double wanted_J = kEnergies_J[static_cast<std::size_t>(trials_) % kEnergies_J.size()];
  const double factor = most_given_J_ > 0 ? std::sqrt(wanted_J / most_given_J_) : kImpulseGrowth;
  impulse_Ns_ = std::min(impulse_Ns_ * std::clamp(factor, kImpulseFall, kImpulseGrowth), kMostImpulse_Ns);
  rest(now_ns);
  if (const Verdict told = verdict(); told != Verdict::kOpen) try_next(told);
}

LimitsSearch::Verdict LimitsSearch::verdict() const {
  if (grown_here_ >= 2) return Verdict::kNotCalm;
  if (trials_here_ < kTrialsMin) return Verdict::kOpen;
  const bool is_last = trials_here_ >= kTrialsMax;
  const Verdict if_unsure = is_last ? Verdict::kUnknown : Verdict::kOpen;
  if (fit_.swings() < SwingFit::kSwingsMin) return if_unsure;
  const SwingFit::Result fit = fit_.result();
  if (!std::isfinite(fit.ratio) || !std::isfinite(fit.ratio_error)) return if_unsure;
  if (!is_last && std::abs(1 - fit.ratio) < kSureErrors * fit.ratio_error) return Verdict::kOpen;
  return fit.ratio < 1 ? Verdict::kCalm : Verdict::kNotCalm;
}

void LimitsSearch::try_next(Verdict told) {
  const double tried = stiffness_N_per_m_;
  fit_ = SwingFit(settings_.position_step_m);
  trials_here_ = grown_here_ = 0;
  if (told == Verdict::kCalm) {
    held_N_per_m_ = tried;
    unknown_in_a_row_ = 0;
  } else if (told == Verdict::kNotCalm) {
    failed_N_per_m_ = tried;
  } else if (held_N_per_m_ > 0 && ++unknown_in_a_row_ >= kUnknownMax) {
    outcome_ = Outcome::kUnresolved;
    return;
  }
  if (failed_N_per_m_ == 0) {
    if (tried >= settings_.most_N_per_m) {
      outcome_ = held_N_per_m_ >= settings_.most_N_per_m / kStiffer ? Outcome::kAllHeld
                 : held_N_per_m_ > 0                                ? Outcome::kUnresolved
                                                                    : Outcome::kNone;
      return;
    }
    stiffness_N_per_m_ = std::min(tried * kStiffer, settings_.most_N_per_m);
    return;
  }
  if (held_N_per_m_ == 0) {
    stiffness_N_per_m_ = failed_N_per_m_ / kStiffer;
    if (told == Verdict::kUnknown || stiffness_N_per_m_ < kSoftest_N_per_m) outcome_ = Outcome::kNone;
    return;
  }
  if (failed_N_per_m_ / held_N_per_m_ < kFineEnough || told == Verdict::kUnknown) {
    outcome_ = Outcome::kFound;
    return;
  }
  stiffness_N_per_m_ = std::sqrt(held_N_per_m_ * failed_N_per_m_);
}

}  // namespace farfeel::devices
