#include "master_station/view/recent_bins.h"

namespace farfeel::master_station {

static_assert(RecentBins::kPieces <= codecs::kMostViewMoments);

void RecentBins::add(const codecs::ViewTick& tick) {
  if (pieces_.empty() || tick.time_ns - begun_ns_ >= kPiece_ns) {
    pieces_.emplace_back();
    begun_ns_ = tick.time_ns;
    if (pieces_.size() > kPieces) pieces_.pop_front();
  }
  codecs::ViewMoment& piece = pieces_.back();
  piece.time_ns = tick.time_ns;
  for (std::size_t i = 0; i < piece.bins.size(); ++i) piece.bins[i].add(tick.bins[i]);
}

}  // namespace farfeel::master_station
