// How a session went in the last half minute, in pieces of 50 ms: what a page is told that begins to look.
#pragma once

#include <deque>

#include "codecs/view/view_tick.h"

namespace farfeel::master_station {

/// Bounded: kPieces pieces, whatever comes.
class RecentBins {
 public:
  static constexpr std::int64_t kPiece_ns = 50'000'000;
  static constexpr std::size_t kPieces = 620;  ///< what the charts show, and a little

  void add(const codecs::ViewTick&);
  [[nodiscard]] codecs::ViewHistory history() const { return {pieces_.begin(), pieces_.end()}; }

 private:
  std::deque<codecs::ViewMoment> pieces_;
  std::int64_t begun_ns_ = 0;  // the newest of them
};

}  // namespace farfeel::master_station
