#include "master_station/devices/hand/sample_source.h"

#include <limits>

namespace farfeel::devices {

std::int64_t silence_ns(const Sample& sample, Reports reports, std::int64_t now_ns) noexcept {
  const std::int64_t heard_ns = reports == Reports::kStream ? sample.time_ns : sample.polled_ns;
  if (heard_ns <= 0) return std::numeric_limits<std::int64_t>::max();
  // The owner may have written the sample after this tick took its time.
  return heard_ns > now_ns ? 0 : now_ns - heard_ns;
}

bool is_heard(const Sample& sample, Reports reports, std::int64_t now_ns) noexcept {
  const bool is_set_up =
      sample.stage == Stage::kReady || sample.stage == Stage::kEnabled || sample.stage == Stage::kStopping;
  return is_set_up && silence_ns(sample, reports, now_ns) < kStaleSample_ns;
}

bool is_usable(const Sample& sample) noexcept {
  return spatial::is_valid(sample.X_BD) && spatial::is_finite(sample.V_BD_B) &&
         spatial::is_finite(sample.deflection.turn) && spatial::is_finite(sample.deflection.push);
}

}  // namespace farfeel::devices
