// A procedure whose result is the device's file: the steps alone write nothing.
#pragma once

#include <fmt/format.h>

#include <utility>

#include "master_station/devices/host/run_procedure.h"

namespace farfeel::devices {

/// Steps: step() as a Procedure's, result() as an optional DeviceFile, cap_N().
template <typename Steps>
class WrittenProcedure final : public Procedure {
 public:
  /// more: what Steps take beside the device's file.
  template <typename... More>
  explicit WrittenProcedure(const OpenedFigures& opened, More&&... more)
      : opened_(opened), steps_(opened.file, std::forward<More>(more)...) {}
  [[nodiscard]] Turn step(std::int64_t now_ns, const Sample& sample, const Heard& heard) override {
    Turn turn = steps_.step(now_ns, sample, heard);
    if (!turn.is_over) return turn;
    if (const auto result = steps_.result()) {
      const auto written = write_device_file(opened_.path, *result, opened_.model);
      is_written_ = written.has_value();
      turn.say.push_back(written ? fmt::format("Written to {}", opened_.path) : written.error().message);
    }
    return turn;
  }
  [[nodiscard]] int status() const override { return is_written_ ? 0 : 1; }
  [[nodiscard]] double cap_N() const { return steps_.cap_N(); }

 private:
  OpenedFigures opened_;
  Steps steps_;
  bool is_written_ = false;
};

}  // namespace farfeel::devices
