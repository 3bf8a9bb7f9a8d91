// `farfeel device calibrate`: which way the axes go, where the middle is, what holds the handle up, and what a
// joystick's force is in newtons. Refuses what no device can have, with the figure.
#pragma once

#include <optional>

#include "master_station/devices/host/procedure.h"
#include "master_station/devices/model/device_file.h"

namespace farfeel::devices {

/// R_BA from movements to the right, away and up, as the driver's frame A tells them: each has to go mostly along one
/// axis, each along another, and together they have to be right-handed. An error says which was not so.
[[nodiscard]] tl::expected<glm::dmat3, std::string> axes_from(const std::array<glm::dvec3, 3>& moved_A, double least);

/// Samples and forces are in A, the driver's own frame. The device's file is as it was until the person says yes.
class CalibrationSteps final : public Procedure {
 public:
  explicit CalibrationSteps(const DeviceFile& before);

  [[nodiscard]] Turn step(std::int64_t now_ns, const Sample&, const Heard&) override;
  [[nodiscard]] int status() const override { return is_accepted_ ? 0 : 1; }
  /// What to write; nothing: the person did not say yes.
  [[nodiscard]] std::optional<DeviceFile> result() const {
    return is_accepted_ ? std::optional(device_) : std::nullopt;
  }
  [[nodiscard]] double cap_N() const noexcept;

  static constexpr double kGravityShare = 0.5;                   ///< of the continuous force, at most
  static constexpr double kLeastFull_N = 0.1, kMostFull_N = 50;  ///< of a joystick at its full level

 private:
  enum class Part : std::uint8_t { kBegin, kAxes, kMiddle, kNeutral, kLift, kSink, kScale, kAccept };

  void ask_axes(Turn&, const Sample&);
  void ask_middle(Turn&);
  void ask_gravity(Turn&);
  void ask_accept(Turn&);
  void axes(Turn&, const Sample&, const std::string& line);
  void middle(Turn&, const Sample&, const std::string& line);
  void neutral(Turn&, std::int64_t now_ns, const Sample&);
  void lift(Turn&, std::int64_t now_ns, const Sample&, const Heard&);
  void sink(Turn&, std::int64_t now_ns, const Sample&, const Heard&);
  void gravity(Turn&, double force_N);
  void scale(Turn&, const std::string& line);

  DeviceFile device_;
  Part part_ = Part::kBegin;
  bool is_accepted_ = false;
  int axis_ = 0;
  Movement movement_;
  std::array<glm::dvec3, 3> moved_A_{};
  std::int64_t since_ns_ = 0, last_ns_ = 0;
  int samples_ = 0;
  Deflection sum_;
  bool was_held_ = false;
  double force_N_ = 0, lifted_N_ = 0, from_m_ = 0;
};

}  // namespace farfeel::devices
