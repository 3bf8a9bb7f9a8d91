// The intermediate representation: what the hand feels between two messages from the remote, and across delays, losses
// and silence.
//
// Rungs: 0, the remote's wrench, held (what most systems do; a comparator); 1, each contact linearised, unilateral,
// clamped, and what was told of it before while that holds (felt_contact.h); 2, the same with the depth's curvature,
// which the remote is asked for; 3, the surfaces themselves (local_contacts.h), linearised anew in every tick. Where
// there is an outline, rungs 1 and 2 feel a place by that until the remote has told of it, and again where what it told
// a round trip ago does not hold any more (felt_once.h).
//
// A contact is received (received_contact.h), matched with those that are felt (match.h), let in (transition.h), and
// pushes (contact_response.h). Every change of the model that would add energy takes it from a tank.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "haptic_core/constraint/tool_step.h"
#include "haptic_core/contact/contact_set.h"
#include "haptic_core/local_model/contact_response.h"
#include "haptic_core/local_model/felt_contact.h"
#include "haptic_core/local_model/local_contacts.h"
#include "haptic_core/local_model/match.h"
#include "haptic_core/local_model/news_age.h"
#include "haptic_core/local_model/pushes.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/passivity/energy_tank.h"
#include "haptic_core/passivity/port_observer.h"
#include "haptic_core/spatial/spatial.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::local_model {

/// How felt contacts push: springs of their own, or rows that the tool may not leave but by the pad (model_rows.cpp).
enum class ContactLaw : std::uint8_t { kPenalty, kConstraint };

/// As on a command line; none where it is neither.
[[nodiscard]] constexpr std::optional<ContactLaw> find_contact_law(std::string_view name) {
  if (name == "penalty") return ContactLaw::kPenalty;
  if (name == "constraint") return ContactLaw::kConstraint;
  return std::nullopt;
}

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
  ContactLaw contact = ContactLaw::kPenalty;  ///< a held wrench has no rows: penalty, whatever this says
  double tool_mass_kg = 0.02;  ///< as simulated: a stiffness that it holds without being told of, it is not told of
  passivity::TankSettings tank;
};

/// kHeld: the newest contacts are kHeldAfter_s older than the lane makes them; kExpired: kFadingAfter_s.
enum class Freshness : std::uint8_t { kNone, kFresh, kHeld, kExpired };

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
  /// After a step under felt.response and before settle(): what each contact exerted within that step, in the step's
  /// own linearisation. Where all find room their forces add up to applied_wrench()'s.
  void tell_pushes(const Felt& felt, const tool::StepWork& stepped, Pushes& out) const noexcept;
  /// Books a step: applied_F_To_W is what the model's response exerted while the tool moved with V for dt to X_WT.
  void settle(const spatial::Vector6& applied_F_To_W, const spatial::Vector6& V_WT_W, double dt_s,
              const spatial::Pose& X_WT) noexcept;

  [[nodiscard]] bool has_rows() const noexcept {
    return settings_.contact == ContactLaw::kConstraint && settings_.rung != Rung::kHeldWrench;
  }
  /// Of rows: where the proxy will be at the step's end if the tool goes on as it does, and no known surface gives way.
  [[nodiscard]] spatial::Pose where_to_look(const constraint::TouchingTool&, double dt_s) const noexcept;
  /// In place of evaluate(): what may not be left in a step, as constraint::take_tick() takes it. Its poses are those
  /// of the settle before. Valid until the next call of any kind.
  [[nodiscard]] std::span<const constraint::Row> rows(const constraint::TouchingTool&, double dt_s) noexcept;
  /// In place of tell_pushes() and settle(), after take_tick() with these rows. The response is empty: the step had it.
  Felt settle(const constraint::TouchingTool&, const constraint::TickReport&, double dt_s, Pushes& pushes) noexcept;

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
  /// Updates that the tank could not pay in full; of rows, steps with news that it could not.
  [[nodiscard]] std::uint64_t truncations() const noexcept { return truncations_; }
  /// Contacts that pressed deep and were gone in the next answer, with nothing of their object left that faces their
  /// way. What they pushed is let go over some milliseconds, as ever; the caller says that something is wrong.
  [[nodiscard]] std::uint64_t lost_while_deep() const noexcept { return lost_while_deep_; }

 private:
  /// The contacts of an update on their way in, sampled as received. Kept, because all are too many to make in a tick.
  struct Arrivals {
    std::size_t count = 0;
    std::array<FeltContact, contact::kMaxContacts> felt;
    std::array<std::size_t, contact::kMaxContacts>
        stays_as;  // one of those before the update, untouched; or kNoContact
    void add(const FeltContact& contact, std::size_t stays_as_felt = kNoContact) noexcept {
      stays_as[count] = stays_as_felt;
      felt[count++] = contact;
    }
  };

  void look_from(const spatial::Pose& X_WT) noexcept;
  [[nodiscard]] FeltContact::Sample sample(const FeltContact&, const spatial::Pose& X_WT) const noexcept;
  [[nodiscard]] double stored_energy_J() const noexcept;
  /// What a change of contacts costs, and gives, by the tank. Of rows nothing yet: their pad pays in the next step,
  /// when the change is news to it (model_rows.cpp).
  double pay(double owed_J) noexcept { return has_rows() ? owed_J : tank_.take(owed_J); }
  void give(double energy_J) noexcept {
    if (!has_rows()) tank_.add(energy_J);
  }
  [[nodiscard]] constraint::Row row_at_rest(const FeltContact&) const noexcept;
  static void recede(FeltContact&, const constraint::Row&, double left_m, const glm::dvec3& leant_W) noexcept;
  [[nodiscard]] spatial::Vector6 surface_twist(const FeltContact&, const glm::dvec3& p_WTo) const noexcept;
  double go_on_moving(FeltContact&, const motion::Moved&, const spatial::Vector6& V_WT_W, double dt_s,
                      const spatial::Pose& X_WT) noexcept;
  [[nodiscard]] double wrench_share() const noexcept;
  void let_in_all(double dt_s, const spatial::Pose& X_WT) noexcept;
  void note_lost(const contact::ContactSet& set) noexcept;
  [[nodiscard]] FeltContact arriving(const contact::ContactSet&, const contact::Contact&, Origin,
                                     double age_s) const noexcept;
  void take_over_beside(const TickContacts&) noexcept;
  void take_over(bool are_all_told) noexcept;
  /// Of an update: what the contacts store that replace others. Springs can be shrunk.
  struct Stored {
    double springs_J = 0, rest_J = 0;
  };
  void begin_new(const Match&, bool are_all_told, Stored&) noexcept;
  std::size_t find_leaving(const Match&, std::array<std::size_t, kMaxFelt>& which) noexcept;

  LocalModelSettings settings_;
  passivity::EnergyTank tank_;
  passivity::PortObserver port_;
  std::array<FeltContact, kMaxFelt> contacts_{};
  std::size_t count_ = 0;
  Arrivals arrivals_;
  spatial::Pose X_WT_;   // where contacts are sampled
  glm::dvec3 pad_W_{0};  // from the proxy to the tool
  std::array<constraint::Row, constraint::kMaxRows> rows_{};
  std::array<std::size_t, constraint::kMaxRows> row_of_{};  // the contact that each row is
  std::size_t row_count_ = 0;
  std::uint64_t rows_named_ = 0;
  spatial::Wrench held_F_To_W_;  // rung 0
  NewsAge news_;
  double tick_s_ = 0;    // the last
  double stored_J_ = 0;  // at the pose of the last call
  std::uint64_t truncations_ = 0, lost_while_deep_ = 0;
  const motion::MovingObjects* moving_ = nullptr;
  double script_work_J_ = 0;
};

}  // namespace farfeel::local_model
