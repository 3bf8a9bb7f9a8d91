// Contacts that come, go or change at once, although the tool has hardly moved, because their clusters were made anew.
//
// The tool's own way explains a change of depth of about as much, and of force of that times the stiffness. What
// is beyond is handed over: the contact as it was goes on as a line (its depth, linear in the pose) and fades while the
// contact as it is fades in, so the force is continuous and the wall neither weaker nor stronger meanwhile. A
// contact that only changes its name goes on as it was. What a hand-over does to the energy stored is told, to be
// judged: the operator's tank pays it, as part of what an update changes there (local_model.cpp). Kim et al. 2003.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/motion/moving_objects.h"

namespace farfeel::contact {

/// Bit of a contact's id: what leaves under the id of one that stays.
inline constexpr std::uint32_t kLeaves = 1u << 31;

struct HandoverOptions {
  double ramp_s = 0.02;         ///< a hand-over takes so long at most: within it a wall is what it was, or less
  double slew_N_per_s = 200;    ///< and less for a small change of force, which then goes by at this rate
  double free_depth_m = 50e-6;  ///< depth that a contact may appear or change with beyond the tool's way
};

/// What a contact was made from. Where it is the same in two answers, its change is the surfaces', and felt, unless no
/// surface is so steep.
struct Making {
  std::uint32_t id = 0;         ///< Contact::id
  std::uint64_t made_from = 0;  ///< of the pieces
  bool is_provisional = false;  ///< its heights are on their way: whatever comes after is right
  bool is_coarse = false;       ///< coarse pairs have a say, which may change their mind on which way is out
  Material material;            ///< whole
};

/// Realtime-safe; one thread.
class Handover {
 public:
  explicit Handover(const HandoverOptions& options = {}) : options_(options) {}

  /// From the contacts as they were found at set.X_WT to those that are felt there. makings: of all of them, in any
  /// order. What a contact has lost of its material's stiffness to others in its place it loses no faster than a ramp.
  /// The first after a restart are felt as found. Contacts may be added, while there is room.
  /// moving: what objects have done since the answer before.
  void apply(ContactSet& set, std::span<const Making> makings, const motion::MovingObjects& moving,
             double dt_s) noexcept;
  void restart() noexcept { has_last_ = false; }

  /// Contacts of the last answer that fade in or out.
  [[nodiscard]] std::uint32_t handed() const noexcept { return handed_; }
  /// Energy stored that came with the last answer and not by the way of tool and objects, as springs push along it by
  /// the trapezoid rule; < 0 where some was lost [J].
  [[nodiscard]] double made_J() const noexcept { return made_J_; }

 private:
  /// A contact as it was felt, without its share.
  struct Felt {
    Contact contact;
    std::uint64_t made_from = 0;
    bool is_provisional = false, is_coarse = false;
    double share = 1;        ///< of its stiffness and damping
    double share_per_s = 0;  ///< how fast that grows, or falls of what leaves
    double place_share = 1;  ///< further: what is left of it beside others in the same place
    double most_depth_m = std::numeric_limits<double>::infinity();  ///< of what leaves: it pushes no harder than it did
  };
  /// The tool's since the last answer, as one object sees it: as if that had always been where it is now.
  struct Way {
    spatial::Vector6 from_last;  ///< of T, in W: rotation, translation
    glm::dvec3 p_WTo_last, p_WTo;
    [[nodiscard]] static Way between(const spatial::Pose& last_X_WT, const spatial::Pose& X_WT) noexcept;
    [[nodiscard]] double at_m(const glm::dvec3& p_W) const noexcept;
    void go_on(Felt&) const noexcept;
  };

  [[nodiscard]] Way way_of(std::uint32_t object, const spatial::Pose& X_WT,
                           const motion::MovingObjects&) const noexcept;
  double go_on(Felt&, const spatial::Pose& X_WT, const motion::MovingObjects&) const noexcept;
  [[nodiscard]] double share_per_s(double change_N) const noexcept;
  void leave(Felt felt, std::uint32_t id) noexcept;
  [[nodiscard]] std::uint32_t predecessor_of(const Felt& now,
                                             const std::array<bool, kMaxContacts>& goes_on) const noexcept;
  void take(Felt& now, Felt was, const Way&, double dt_s) noexcept;
  void appear(Felt& now, const Way&) const noexcept;

  HandoverOptions options_;
  std::array<Felt, kMaxContacts> last_{}, now_{}, leaving_{};
  std::uint32_t last_count_ = 0, now_count_ = 0, leaving_count_ = 0, handed_ = 0;
  spatial::Pose last_X_WT_;
  double made_J_ = 0, last_stored_J_ = 0;
  bool has_last_ = false;
};

}  // namespace farfeel::contact
