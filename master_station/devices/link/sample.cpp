#include "master_station/devices/link/sample.h"

namespace farfeel::devices {

std::string_view name(Stage stage) noexcept {
  constexpr std::array<std::string_view, kStages> kNames{"absent",  "opening",  "firmware", "homing", "ready",
                                                         "enabled", "stopping", "fault",    "trying"};
  const auto i = static_cast<std::size_t>(stage);
  return i < kNames.size() ? kNames[i] : "unknown";
}

}  // namespace farfeel::devices
