#include "transport/lane/arrival_meter.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfeel::transport {

void ArrivalMeter::on_datagram(const Received& received) noexcept {
  bytes_ += received.bytes.size();
  if (!received.has_marking) return;
  dscp_ = received.dscp;
  if (received.ecn == Ecn::kCongestion) ++congestion_marks_;
}

void ArrivalMeter::on_transit(std::uint32_t sent_us, std::uint32_t arrived_us) noexcept {
  constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::max();
  const std::uint32_t transit_us = arrived_us - sent_us;
  if (!has_any_) {
    has_any_ = true;
    first_us_ = transit_us;
    slice_began_us_ = arrived_us;
    least_us_.fill(kNone);
  } else {
    const auto from_last_us = static_cast<std::int32_t>(transit_us - first_us_) - last_us_;
    jitter_us_ += (std::abs(static_cast<double>(from_last_us)) - jitter_us_) / 16;
  }
  last_us_ = static_cast<std::int32_t>(transit_us - first_us_);
  // After a pause longer than the window all slices are old.
  for (std::size_t turns = 0; arrived_us - slice_began_us_ >= kSlice_us && turns < kSlices; ++turns) {
    slice_began_us_ += kSlice_us;
    slice_ = (slice_ + 1) % kSlices;
    least_us_[slice_] = kNone;
  }
  if (arrived_us - slice_began_us_ >= kSlice_us) slice_began_us_ = arrived_us;
  least_us_[slice_] = std::min(least_us_[slice_], last_us_);
  const std::int32_t least_us = *std::min_element(least_us_.begin(), least_us_.end());
  excess_.add(1000 * (std::int64_t{last_us_} - least_us));
}

}  // namespace farfeel::transport
