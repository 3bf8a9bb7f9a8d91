// `farfeel device test`: does the handle tell where it goes, and push where it says? With weak forces that a person
// consented to.
#pragma once

#include "master_station/devices/host/procedure.h"
#include "master_station/devices/model/device_model.h"

namespace farfeel::devices {

class ForceTest final : public Procedure {
 public:
  ForceTest(const DeviceModel& model, bool has_consent);

  [[nodiscard]] Turn step(std::int64_t now_ns, const Sample&, const Heard&) override;
  [[nodiscard]] int status() const override { return failed_ == 0 && is_over_ ? 0 : 1; }
  /// Weak: 1 N at most, and a fifth of what the device gives for ever at most.
  [[nodiscard]] double force_N() const noexcept { return force_N_; }

  static constexpr double kMost_N = 1, kMostShare = 0.2;

 private:
  enum class Part : std::uint8_t { kBegin, kMoves, kConsent, kHold, kPush, kAnswer, kVerdict };

  void ask_to_move(Turn&, const Sample&);
  void after_moves(Turn&);
  void ask_to_hold(Turn&);
  void answer(Turn&, const std::string& line);
  void verdict(Turn&, std::int64_t now_ns, const Sample&);
  void check(Turn&, bool is_good, const std::string& what);

  DeviceModel model_;
  bool has_consent_, is_over_ = false;
  double force_N_;
  Part part_ = Part::kBegin;
  int axis_ = 0, sign_ = 1;  // of the movement or the push
  Movement movement_;
  std::int64_t pushed_ns_ = 0, begun_ns_ = 0, last_ns_ = 0;
  std::uint64_t first_report_ = 0;
  std::uint32_t buttons_ = 0;
  int good_ = 0, failed_ = 0;
};

}  // namespace farfeel::devices
