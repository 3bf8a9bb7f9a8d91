// How old the remote's newest answer is, beyond what the lane takes anyway.
//
//   age    = now - the time of the pose that it answers
//   least  = min over the last kAgesWindow_s of what ages were as answers arrived: the lane's own round trip
//   excess = age - least: how long the answer waited in a queue, and how long none has come since
//
// A lane that takes 300 ms all the time has no excess. Answers that waited in a queue have one, though they arrive as
// often as ever. Where the lane itself becomes longer, the excess is the difference for as long as the window remembers
// the shorter one, kAgesWindow_s at most. Where it becomes shorter, the first answer says so.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "haptic_core/local_model/constants.h"

namespace farfeel::local_model {

/// Realtime-safe; one thread.
class NewsAge {
 public:
  void pass(double dt_s) noexcept {
    age_s_ += dt_s;
    silence_s_ += dt_s;
  }
  /// An answer to a pose of age_s ago has come; newer than those before.
  void hear(double age_s) noexcept {
    since_s_ = silence_s_;
    // In a silence the window stands still: what comes first after it may have waited all the while.
    into_slice_s_ += has_heard_ ? std::min(silence_s_, kLongestSilence_s) : 0;
    for (; into_slice_s_ >= kSlice_s; into_slice_s_ -= kSlice_s) {
      slice_ = (slice_ + 1) % kSlices;
      slices_s_[slice_] = kNever_s;
    }
    if (!has_heard_) slices_s_.fill(kNever_s);
    has_heard_ = true;
    silence_s_ = 0;
    age_s_ = std::max(0.0, age_s);
    slices_s_[slice_] = std::min(slices_s_[slice_], age_s_);
    least_s_ = std::min(kMostRoundTrip_s, *std::min_element(slices_s_.begin(), slices_s_.end()));
  }

  [[nodiscard]] bool has_heard() const noexcept { return has_heard_; }
  [[nodiscard]] double age_s() const noexcept { return age_s_; }      ///< of the newest answer's pose
  [[nodiscard]] double least_s() const noexcept { return least_s_; }  ///< 0 before any answer
  [[nodiscard]] double excess_s() const noexcept { return age_s_ - least_s_; }
  [[nodiscard]] double since_s() const noexcept { return since_s_; }  ///< between the last two answers

 private:
  static constexpr std::size_t kSlices = 20;
  static constexpr double kSlice_s = kAgesWindow_s / kSlices;
  static constexpr double kNever_s = std::numeric_limits<double>::infinity();

  std::array<double, kSlices> slices_s_{};  // the least age of each slice of the window, a ring
  std::size_t slice_ = 0;                   // the newest
  double into_slice_s_ = 0;
  double age_s_ = 0, silence_s_ = 0, since_s_ = 0, least_s_ = 0;
  bool has_heard_ = false;
};

}  // namespace farfeel::local_model
