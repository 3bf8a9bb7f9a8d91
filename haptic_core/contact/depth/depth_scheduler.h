// Which contacts of an answer are searched, and what the others are meanwhile.
//
// A search is what a depth costs. Between two searches a depth is extrapolated (extrapolation.h), which is good for a
// while:
//   urgency = displacement since the search / allowed displacement,   or answers since / allowed answers.
// From 1 on a contact has to be searched. What is left of the budget goes to the others, the most urgent first.
//
//   a contact that may push      is allowed a fraction of a ridge, where a budget is set; else nothing: it is searched
//   in
//                                every answer
//   one that is too far to push  is allowed a part of its gap, and never has to be searched: most_depth_m() bounds it
//   one that is new              is known by no search: it has to be searched where it may push, and comes first where
//   not
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/depth/extrapolation.h"
#include "haptic_core/contact/tracking/per_track.h"

namespace farfeel::contact {

struct DepthSchedule {
  /// Searches in one answer, and no more once one was costly (BackEnd::searches); 0: every contact that may push, and
  /// one of the others.
  std::uint32_t most_searches = 0;
  /// penetration::Traits::may_substitute; false: everything is searched.
  bool may_extrapolate = true;
};

/// One contact of an answer.
struct DepthJob {
  std::size_t i = 0;  ///< number of its track
  penetration::Query query;
  double most_depth_m = 0;  ///< see DepthScheduler::most_depth_m()
  double urgency = 0;
};

/// Whether heights were lacking when a depth was searched, and how far off that leaves it.
struct HeightLack {
  bool lacks = false;
  double off_m = 0;
};

/// Realtime-safe; one thread.
class DepthScheduler {
 public:
  DepthScheduler(const penetration::FeltSurface& tool, const DepthSchedule&);

  void begin_answer() noexcept { count_ = others_ = 0; }
  void add(std::size_t i, const penetration::Query&) noexcept;
  /// All that were added, the most urgent first.
  [[nodiscard]] std::span<DepthJob> by_urgency() noexcept;
  /// Whether this one is to be searched now. searched: how many of this answer were, costly of them. A yes counts.
  [[nodiscard]] bool takes(const DepthJob&, std::size_t searched, std::uint64_t costly) noexcept;
  [[nodiscard]] bool has_budget() const noexcept { return schedule_.may_extrapolate && schedule_.most_searches > 0; }

  /// What a search found, or that it found nothing.
  void keep(const penetration::Query&, const penetration::Penetration& found, const HeightLack&) noexcept;
  /// The depth of a contact that is not searched; unknown where it never was.
  [[nodiscard]] penetration::Penetration extrapolated(const DepthJob&) noexcept;
  /// As it was when the contact was searched last.
  [[nodiscard]] HeightLack lack(std::uint32_t contact) const noexcept;
  void restart() noexcept { searched_.restart(); }

  /// No back end finds a depth of more [m]: see penetration::Query::deepest_m, and what relief can add to it.
  [[nodiscard]] double most_depth_m(const penetration::Query&) const noexcept;

 private:
  struct Searched {
    Extrapolation last;
    std::uint32_t answers = 0;  // since
    HeightLack lack;
  };
  [[nodiscard]] double urgency_of(const penetration::Query&, double most_depth_m) const noexcept;

  DepthSchedule schedule_;
  double tool_area_m2_;
  PerTrack<Searched> searched_;
  std::array<DepthJob, kMaxContacts> jobs_{};
  std::size_t count_ = 0, others_ = 0;  // of this answer; those searched that did not have to be
};

}  // namespace farfeel::contact
