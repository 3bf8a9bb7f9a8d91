#include <fmt/format.h>

#include "master_station/devices/host/calibration_steps.h"
#include "master_station/devices/host/run_procedure.h"

namespace farfeel::devices {
namespace {

/// The steps, and the file that they end in.
class Calibrating final : public Procedure {
 public:
  explicit Calibrating(const OpenedFigures& opened) : opened_(opened), steps_(opened.file) {}
  [[nodiscard]] Turn step(std::int64_t now_ns, const Sample& sample, const Heard& heard) override {
    Turn turn = steps_.step(now_ns, sample, heard);
    if (const auto result = steps_.result(); turn.is_over && result) {
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
  CalibrationSteps steps_;
  bool is_written_ = false;
};

}  // namespace

int calibrate(const Hardware& hardware) {
  return run_procedure(hardware, [](const OpenedFigures& opened, RunSettings& settings) {
    auto procedure = std::make_unique<Calibrating>(opened);
    settings.cap_N = procedure->cap_N();
    settings.applies_calibration = false;
    return procedure;
  });
}

}  // namespace farfeel::devices
