// The intermediate representation: what the hand feels between two messages from the remote, and across delays, losses
// and silence.
//
// Rungs: 0, the remote's wrench, held (what most systems do; a comparator); 1, each contact linearised, unilateral,
// clamped, and what was told of it before while that holds (felt_contact.h); 2, the same with the depth's curvature,
// which the remote is asked for; 3, the surfaces themselves (local_contacts.h), linearised anew in every tick. Where
// there is an outline, rungs 1 and 2 feel a place by that until the remote has told of it, and again where what it told
// a round trip ago does not hold any more (felt_once.h). Every change of the model that would add energy takes it from
// a tank; every change of force is matched to the force before and let in over some 20 ms. Adachi 1993 and Mark et al.
// 1996 for the idea; the tank in place of Mark's fixed recovery time.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/local_model/felt_contact.h"
#include "haptic_core/local_model/local_contacts.h"
#include "haptic_core/local_model/news_age.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/passivity/energy_tank.h"
#include "haptic_core/passivity/port_observer.h"
#include "haptic_core/spatial/spatial.h"
#include "haptic_core/tool/linear_response.h"

namespace farfeel::local_model {

enum class Rung : std::uint8_t { kHeldWrench = 0, kLinear = 1, kQuadratic = 2, kTiles = 3 };

/// As on a command line.
[[nodiscard]] constexpr std::string_view name(Rung rung) {
  switch (rung) {
    case Rung::kHeldWrench:
      return "held";
    case Rung::kLinear:
      return "linear";
    case Rung::kQuadratic:
      return "quadratic";
    case Rung::kTiles:
      return "tiles";
  }
  return "unknown";
}

struct LocalModelSettings {
  Rung rung = Rung::kLinear;
  double held_after_s = 0.05;    ///< of NewsAge::excess_s: geometry is held; a held wrench begins to fade
  double fading_after_s = 0.25;  ///< of the same: force fades, and nothing is taken over any more
  double fade_s = 0.1;    ///< from full to no stiffness; with 0.4 of it as time constant where force would go faster
  double bleed_s = 0.01;  ///< time constant of what is let in or let go after an update
  double bleed_N_per_s = 100;     ///< and the fastest that it is let in, over all contacts
  double soon_gone_N = 0.3;       ///< contacts that are gone and pushed with less in sum
  double leave_N_per_s = 80;      ///< leave so fast at least, over all; others may be back in a moment; fades at most
  double free_step_N = 0.1;       ///< change of force that one update may make at once, over all contacts
  double slope_step_N = 0.2;      ///< change of sideways force that one tick or update may make, over all contacts
  double torque_step_Nm = 0.005;  ///< change of torque that points which jump may make in a tick, over all contacts
  double surprise_J = 0.001;      ///< of debt, that depths may make which no linearisation promised
  double tool_mass_kg = 0.02;     ///< as simulated: a stiffness that it holds without being told of, it is not told of
  passivity::TankSettings tank;
};

enum class Freshness : std::uint8_t { kNone, kFresh, kHeld, kExpired };

/// What the local model is at one tool pose.
struct Felt {
  /// On the tool, about To, for a step of dt_s: contacts that will touch within it are there with their gap.
  tool::LinearResponse response;
  double depth_max_m = 0;        ///< of the contacts as received, not below 0
  std::uint32_t pressing = 0;    ///< contacts that push
  double energy_J = 0;           ///< stored in the contacts
  std::uint32_t by_outline = 0;  ///< contacts that push with heights of the outline in place of those that are late
  double outline_off_m = 0;      ///< how far the depth of such is from the true one, at most
};

/// Every call is realtime-safe and for one thread. In each tick: go_along where objects move, advance, then update when
/// contacts arrived (with an outline: hear then, and refresh in every tick while is_refreshed()), then evaluate, then
/// the tool's step, then settle.
class LocalModel {
 public:
  explicit LocalModel(const LocalModelSettings&);

  /// Objects have moved while the tool stood still: contacts go along with them. What that stores is the script's work,
  /// not the tank's. The objects outlive the model, and are those of update() and evaluate() until the next call.
  void go_along(const motion::MovingObjects& objects, const spatial::Pose& X_WT) noexcept;
  /// Lets time pass at a tool pose: fades, lets in what the tank affords, lets go of what is gone.
  void advance(double dt_s, const spatial::Pose& X_WT) noexcept;
  /// Takes over newer contacts at a tool pose without a jump in force. age_s: since the pose that they answer. They are
  /// only heard while they are expired: what waited in a queue ends no fading. What is new in old ones is in part what
  /// the tool itself did then: the older, the slower they are followed, or a tool that swings would hear its own echo
  /// and swing on. Precondition: is_usable(set).
  void update(const contact::ContactSet& set, const spatial::Pose& X_WT, double age_s = 0) noexcept;
  /// The remote has answered a pose of age_s ago, and what it says comes with the next refresh().
  void hear(const contact::ContactSet& set, double age_s = 0) noexcept;
  /// How far ahead of a step of dt_s contacts are best looked for in rung 3, 0 to dt_s / 2. What a step applies is held
  /// for all of it, and is half a tick late if it is the force at its beginning, half a tick early at its end. Contacts
  /// from tiles are felt as they are amid the step, and push with the mean of what the step stores, while the tool
  /// moves along them and is heavy enough to hold them without a step that damps. At rest, where it is light, and
  /// on objects that move by a script it keeps backward Euler's end of the step.
  [[nodiscard]] double ahead_s(const spatial::Pose& X_WT, const spatial::Twist& V_WT_W, double dt_s) const noexcept;
  /// Takes over the contacts of this very pose: in rung 3 those of LocalContacts::at(), else of beside_remote(). One
  /// that comes from where it came from in the tick before is the same model at another pose, and taken as it is; all
  /// else is an update. The pose they were found at may lie a little ahead of X_WT, by ahead_s(). Without effect while
  /// nothing is heard of the remote (is_refreshed): force fades then, whatever the surfaces are.
  void refresh(const TickContacts&, const spatial::Pose& X_WT) noexcept;
  [[nodiscard]] Felt evaluate(const spatial::Pose& X_WT, const spatial::Twist& V_WT_W, double dt_s) const noexcept;
  /// Books a step: applied_F_To_W is what the model's response exerted while the tool moved with V for dt to X_WT.
  void settle(const spatial::Vector6& applied_F_To_W, const spatial::Vector6& V_WT_W, double dt_s,
              const spatial::Pose& X_WT) noexcept;

  [[nodiscard]] Freshness freshness() const noexcept;
  /// Whether refresh() has an effect: the remote is heard. Else nobody need look for contacts.
  [[nodiscard]] bool is_refreshed() const noexcept {
    return freshness() == Freshness::kFresh || freshness() == Freshness::kHeld;
  }
  [[nodiscard]] const NewsAge& news() const noexcept { return news_; }
  [[nodiscard]] Rung rung() const noexcept { return settings_.rung; }
  [[nodiscard]] const passivity::EnergyTank& tank() const noexcept { return tank_; }
  /// Energy that went from the tool into the model.
  [[nodiscard]] const passivity::PortObserver& contact_port() const noexcept { return port_; }
  /// Energy that objects which move by a script have put into the model less what they got back.
  [[nodiscard]] double script_work_J() const noexcept { return script_work_J_; }
  /// Updates that the tank could not pay in full.
  [[nodiscard]] std::uint64_t truncations() const noexcept { return truncations_; }
  /// Contacts that pressed deep and were gone in the next answer, with nothing of their object left that faces their
  /// way. What they pushed is let go over some milliseconds, as ever; the caller says that something is wrong.
  [[nodiscard]] std::uint64_t lost_while_deep() const noexcept { return lost_while_deep_; }

 private:
  static constexpr std::size_t kMaxFelt = 2 * contact::kMaxContacts;  // those received, and as many that leave

  [[nodiscard]] double stored_energy_J(const spatial::Pose& X_WT) const noexcept;
  [[nodiscard]] spatial::Vector6 surface_twist(const FeltContact&, const glm::dvec3& p_WTo) const noexcept;
  double go_on_moving(FeltContact&, const motion::Moved&, const spatial::Vector6& V_WT_W, double dt_s,
                      const spatial::Pose& X_WT) noexcept;
  [[nodiscard]] double wrench_share() const noexcept;
  [[nodiscard]] double damping_Ns_per_m(const FeltContact&) const noexcept;
  [[nodiscard]] double held_without_N_per_m(double dt_s) const noexcept;
  using Samples = std::array<FeltContact::Sample, kMaxFelt>;
  [[nodiscard]] double mean_share(const Samples&, const spatial::Twist& V_WT_W, double dt_s) const noexcept;
  struct Inheritance;
  struct Arrivals;
  [[nodiscard]] bool is_lost_while_deep(const FeltContact& old, const contact::ContactSet& set) const noexcept;
  void note_lost(const contact::ContactSet& set) noexcept;
  [[nodiscard]] FeltContact arriving(const contact::ContactSet&, std::size_t i, Source,
                                     double remote_age_s) const noexcept;
  void take_over_beside(const TickContacts&, const spatial::Pose& X_WT) noexcept;
  void take_over(Arrivals&, const spatial::Pose& X_WT) noexcept;
  void go_on(const FeltContact& old, FeltContact& now, std::size_t count, const spatial::Pose& X_WT) noexcept;
  double begin(FeltContact&, const Inheritance& before, std::size_t count, const spatial::Pose& X_WT) noexcept;
  void hold_back(FeltContact&, double goal_m, const spatial::Pose& X_WT) noexcept;
  struct LetIn {  // of one contact, in one tick
    double felt_m = 0, change_m = 0;
    double costs_J = 0;  // < 0: gives
  };
  [[nodiscard]] LetIn to_let_in(FeltContact&, double dt_s, const spatial::Pose& X_WT) noexcept;
  void let_in(double dt_s, const spatial::Pose& X_WT) noexcept;
  void follow(FeltContact&, double dt_s, const spatial::Pose& X_WT) noexcept;

  LocalModelSettings settings_;
  passivity::EnergyTank tank_;
  passivity::PortObserver port_;
  std::array<FeltContact, kMaxFelt> contacts_{};
  std::size_t count_ = 0;
  spatial::Wrench held_F_To_W_;  // rung 0
  NewsAge news_;
  double tick_s_ = 0;    // the last
  double stored_J_ = 0;  // at the pose of the last call
  std::uint64_t truncations_ = 0, lost_while_deep_ = 0;
  const motion::MovingObjects* moving_ = nullptr;
  double script_work_J_ = 0;
};

/// Whether a set may be felt at all: finite, count in range, unit directions, depths and materials of a sane size.
[[nodiscard]] bool is_usable(const contact::ContactSet&) noexcept;

}  // namespace farfeel::local_model
