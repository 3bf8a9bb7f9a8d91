// `farfeel device identify-limits`: the search of limits_search.h along each axis that the device pushes along, with
// the person's consent.
#pragma once

#include <optional>

#include "master_station/devices/host/limits_search.h"
#include "master_station/devices/host/procedure.h"
#include "master_station/devices/model/device_file.h"

namespace farfeel::devices {

class LimitsSteps final : public Procedure {
 public:
  LimitsSteps(const DeviceFile& before, bool has_consent);

  [[nodiscard]] Turn step(std::int64_t now_ns, const Sample&, const Heard&) override;
  [[nodiscard]] int status() const override { return result_ ? 0 : 1; }
  /// With the coupling of the softest axis; nothing: not all axes could be told.
  [[nodiscard]] const std::optional<DeviceFile>& result() const { return result_; }
  [[nodiscard]] double cap_N() const noexcept;

 private:
  [[nodiscard]] LimitsSearch::Settings settings() const;
  void end_axis(Turn&);

  DeviceFile device_;
  bool has_consent_, has_begun_ = false;
  int axis_ = 0;
  LimitsSearch search_;
  double told_N_per_m_ = 0, softest_N_per_m_ = 0;
  std::optional<DeviceFile> result_;
};

}  // namespace farfeel::devices
