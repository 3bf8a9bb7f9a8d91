// Whether a tick looks at the tiles: each one that took most of its period is followed by one that does not, and where
// too many do, tiles may rest for a while. A late tick is worse than one on a linearisation.
#pragma once

#include <algorithm>
#include <cstdint>

namespace farfeel::master_station {

/// Realtime-safe; one thread.
class TilesPace {
 public:
  enum class Tick : std::uint8_t {
    kLooks,
    kSpared,  ///< feels what the tick before found, linearised
    kRests,   ///< feels the remote's contacts
  };
  /// Once a tick: what the one before took of its period, and how long a period is. may_rest: the remote's own contacts
  /// are about as good, because they are fresh.
  [[nodiscard]] Tick next(double work_share, double period_s, bool may_rest) noexcept {
    if (!may_rest) rest_left_s_ = 0;
    if (rest_left_s_ > 0) {
      rest_left_s_ -= period_s;
      return Tick::kRests;
    }
    const bool is_spared = work_share > kMostWork;
    // Of ticks: a part of the one that is spared now, more where others never came.
    const double lost = is_spared ? 2 * work_share - 1 : 0;
    spared_share_ += (lost - spared_share_) * std::min(period_s / kWindow_s, 1.0);
    calm_s_ = spared_share_ < kFewSpared ? calm_s_ + period_s : 0;
    if (calm_s_ > kCalm_s) rest_s_ = kFirstRest_s;
    if (may_rest && spared_share_ > kMostSpared) {
      rest_left_s_ = rest_s_;
      rest_s_ = std::min(2 * rest_s_, kLongestRest_s);
      spared_share_ = 0;
      return Tick::kRests;
    }
    return is_spared ? Tick::kSpared : Tick::kLooks;
  }
  [[nodiscard]] bool is_resting() const noexcept { return rest_left_s_ > 0; }

 private:
  static constexpr double kMostWork = 0.6;  ///< of a period, before tiles are spared for a tick
  /// Of the ticks within about a window, spared or lost.
  static constexpr double kMostSpared = 0.1, kFewSpared = 0.03, kWindow_s = 0.5;
  /// What did not fit is tried again after a rest, and each time after twice as long a one, until all is calm.
  static constexpr double kFirstRest_s = 2, kLongestRest_s = 64, kCalm_s = 10;

  double spared_share_ = 0, rest_left_s_ = 0, rest_s_ = kFirstRest_s, calm_s_ = 0;
};

}  // namespace farfeel::master_station
