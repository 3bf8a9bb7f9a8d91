// The stiffest virtual spring that is calm on the device at hand, along one axis: found from soft to stiff by small
// kicks, each of which ends before it has given kMostGiven_J to the handle.
//
// A trial: the handle rests without force; a spring K and damping B hold it where it is; a kick of at most kMostKick_N
// gets it out of its friction at rest, which would hide the limit tenfold; then the swing is looked at (swing_fit.h). A
// stiffness held when the swings, but for what dry friction takes, grow smaller. What is taken is kTaken of the
// stiffest that held.
//
// Pure: a sample in, a force out, time as an argument. One thread; one step a tick of 1 ms.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "master_station/devices/host/swing_fit.h"

namespace farfeel::devices {

class LimitsSearch {
 public:
  struct Settings {
    double damping_Ns_per_m = 0;  ///< B, of every trial
    double position_step_m = 0;   ///< of the encoder
    double delay_s = 0;  ///< from a movement to the force that answers it, the tick's hold apart; to kDelayDoubt_s less
    double first_N_per_m = 100;  ///< softest that is tried
    double most_N_per_m = 20'000;
  };
  struct Input {
    double position_m = 0, velocity_m_s = 0;
    bool may_push = false;  ///< the sample is fresh, the device is ready, and the person wants force
  };
  enum class Outcome : std::uint8_t {
    kFound,       ///< held, and the next stiffer one did not
    kAllHeld,     ///< up to most_N_per_m
    kUnresolved,  ///< held, and stiffer ones could not be told: the encoder is too coarse for the small swings
    kNone         ///< nothing could be told: friction is stronger than the kicks, or it is never calm
  };

  explicit LimitsSearch(const Settings&);

  /// The force on the hand along the axis, until the next step.
  double step(std::int64_t now_ns, const Input&);

  [[nodiscard]] std::optional<Outcome> outcome() const { return outcome_; }
  [[nodiscard]] double held_N_per_m() const { return held_N_per_m_; }  ///< the stiffest that held; 0: none
  [[nodiscard]] double taken_N_per_m() const { return kTaken * held_N_per_m_; }
  [[nodiscard]] double trying_N_per_m() const { return stiffness_N_per_m_; }
  [[nodiscard]] int trials() const { return trials_; }
  [[nodiscard]] bool is_trial() const { return phase_ != Phase::kResting; }
  /// Of the trial under way, by the ledger [J].
  [[nodiscard]] double given_J() const { return given_J_; }

  static constexpr double kTaken = 2.0 / 3;
  static constexpr double kMostKick_N = 2;
  static constexpr double kMostForce_N = 4;      ///< of kick and coupling together
  static constexpr double kMostGiven_J = 1e-3;   ///< to the handle, a trial
  static constexpr double kDelayDoubt_s = 1e-3;  ///< a device may be later by that than its data says
  static constexpr double kMostTravel_m = 0.01;  ///< from where a trial began

 private:
  enum class Phase : std::uint8_t { kResting, kKicked, kSwinging };
  enum class Verdict : std::uint8_t { kOpen, kCalm, kNotCalm, kUnknown };

  void rest(std::int64_t now_ns);
  void begin_trial(std::int64_t now_ns, const Input&);
  void end_trial(std::int64_t now_ns, bool rests);
  [[nodiscard]] Verdict verdict() const;
  void try_next(Verdict);
  [[nodiscard]] bool is_still(double position_m);
  [[nodiscard]] double under_way_J(const Input&) const;
  [[nodiscard]] double least_swing_m() const;

  Settings settings_;
  std::size_t most_delay_ticks_;
  Phase phase_ = Phase::kResting;
  std::optional<Outcome> outcome_;

  // Of the stiffness that is tried.
  double stiffness_N_per_m_, held_N_per_m_ = 0, failed_N_per_m_ = 0;
  int unknown_in_a_row_ = 0;
  int trials_here_ = 0, grown_here_ = 0, trials_ = 0;
  SwingFit fit_;

  // Of the kick: its impulse for a given energy is learnt from one trial to the next.
  double impulse_Ns_;
  int kick_ticks_ = 0, kick_tick_ = 0;
  double kick_N_ = 0;

  // Of the trial under way.
  std::int64_t phase_ns_ = 0, still_ns_ = 0;
  double rest_at_m_ = 0, last_m_ = 0;
  static constexpr std::size_t kForces = 64;  ///< that are remembered [ticks]
  /// A ledger for each delay that the device may have, from none on; given_J_ is the greatest of them.
  std::array<double, kForces> ledgers_J_{};
  double given_J_ = 0, most_given_J_ = 0;
  int swings_grown_ = 0;
  std::size_t free_from_ = 0;  ///< the first of its samples on which no kick acts
  TurningPoints turns_;
  std::array<double, kForces> forces_N_{};  ///< the last ones, newest at tick_
  std::size_t tick_ = 0;
};

[[nodiscard]] std::string_view in_words(LimitsSearch::Outcome);

}  // namespace farfeel::devices
