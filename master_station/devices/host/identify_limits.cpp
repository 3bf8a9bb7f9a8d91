#include <fmt/format.h>

#include "master_station/devices/host/limits_steps.h"
#include "master_station/devices/host/run_procedure.h"

namespace farfeel::devices {
namespace {

/// The steps, and the file that they end in.
class Identifying final : public Procedure {
 public:
  Identifying(const OpenedFigures& opened, bool has_consent) : opened_(opened), steps_(opened.file, has_consent) {}
  [[nodiscard]] Turn step(std::int64_t now_ns, const Sample& sample, const Heard& heard) override {
    Turn turn = steps_.step(now_ns, sample, heard);
    if (turn.is_over && steps_.result()) {
      const auto written = write_device_file(opened_.path, *steps_.result(), opened_.model);
      is_written_ = written.has_value();
      turn.say.push_back(written ? fmt::format("Written to {}", opened_.path) : written.error().message);
    }
    return turn;
  }
  [[nodiscard]] int status() const override { return is_written_ ? 0 : 1; }
  [[nodiscard]] double cap_N() const { return steps_.cap_N(); }

 private:
  OpenedFigures opened_;
  LimitsSteps steps_;
  bool is_written_ = false;
};

}  // namespace

int identify_limits(const Hardware& hardware, bool has_consent) {
  return run_procedure(hardware, [&](const OpenedFigures& opened, RunSettings& settings) {
    auto procedure = std::make_unique<Identifying>(opened, has_consent);
    settings.cap_N = procedure->cap_N();
    return procedure;
  });
}

}  // namespace farfeel::devices
