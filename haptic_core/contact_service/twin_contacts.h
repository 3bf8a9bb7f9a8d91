// Contacts that have found the same place of the surfaces: of two only one is searched an answer, in turn.
//
// Two clusters that share large pieces often find the same place, and press there as one contact
// (contact/repeats.h). The one that is not searched is what the other is now, plus what it was more than that
// when both were searched last,
//   depth_B = depth_A + (depth_B - depth_A)_then,   and likewise gradient and point, in S.
// So whatever one of them alone may come to feel is felt an answer later at most. Where the other has gone elsewhere
// both are searched.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "haptic_core/contact/cluster.h"
#include "haptic_core/contact/contact_set.h"
#include "haptic_core/penetration/back_end.h"

namespace farfeel::contact_service {

/// Realtime-safe; one thread.
class TwinContacts {
 public:
  /// Queries, clusters and answers of an answer's contacts, in one order; at most kMaxContacts. The queries are told
  /// apart by Query::contact.
  void evaluate(penetration::BackEnd&, std::span<const penetration::Query>, std::span<const contact::Cluster* const>,
                std::span<penetration::Penetration>) noexcept;
  void restart() noexcept { ties_ = {}; }

  /// How many contacts of the last answer were not searched.
  [[nodiscard]] std::uint32_t followed() const noexcept { return followed_; }

  /// After so many answers both are searched again.
  static constexpr std::uint32_t kMostFollowed = 8;
  /// So far the place may be from where it was then, and the tool may have gone there since the last answer [m].
  static constexpr double kMostWay_m = 1.5e-3, kMostStep_m = 0.25e-3;

 private:
  static constexpr std::size_t kMost = contact::kMaxContacts, kSlots = 64;

  /// What a search found, in S.
  struct Found {
    glm::dvec3 p_S{0};
    double depth_m = 0;
    glm::dvec3 turning_S{0}, moving_S{0};  // the gradient's halves
    [[nodiscard]] static Found of(const penetration::Query&, const penetration::Penetration&) noexcept;
    [[nodiscard]] penetration::Penetration in(const penetration::Query&, std::uint32_t doubts) const noexcept;
    [[nodiscard]] Found plus(const Found& other, double times) const noexcept;
  };
  /// Of two contacts, kept in the second one's slot.
  struct Tie {
    std::uint32_t first = 0, second = 0;
    std::uint32_t followed = 0;  // answers since both were searched
    bool is_settled = false;     // they differed by as much the time before
    glm::dvec3 p_first_S{0};     // then
    spatial::Pose X_ST;          // at the last answer
    Found more;                  // what the second one was more than the first
  };
  struct Pair {
    std::size_t first, second;
    bool is_one_searched = false, does_first_follow = false;
  };

  [[nodiscard]] Tie& tie_of(const penetration::Query& second) { return ties_[second.contact % kSlots]; }
  void pair_up(std::span<const penetration::Query>, std::span<const contact::Cluster* const>) noexcept;
  void search(penetration::BackEnd&, std::span<const penetration::Query>, std::span<const std::size_t> which,
              std::span<penetration::Penetration>) noexcept;
  [[nodiscard]] bool follow(const Pair&, std::span<const penetration::Query>,
                            std::span<penetration::Penetration>) noexcept;
  void tie(const penetration::Query& first, const penetration::Penetration& of_first, const penetration::Query& second,
           const penetration::Penetration& of_second) noexcept;

  std::array<Tie, kSlots> ties_{};
  std::array<Pair, kMost> pairs_{};
  std::size_t pair_count_ = 0;
  std::array<penetration::Query, kMost> asked_;
  std::array<penetration::Penetration, kMost> found_;
  std::uint32_t followed_ = 0;
};

}  // namespace farfeel::contact_service
