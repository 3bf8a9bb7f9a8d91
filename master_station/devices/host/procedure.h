// What a person and a device do together, step by step: test, calibration, identification. Pure: what the device tells,
// what the person said and the time go in; words, and a force while the person wants it, come out.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "master_station/devices/link/sample.h"

namespace farfeel::devices {

struct Heard {
  std::optional<std::string> line;  ///< that was typed since the last step
  bool is_held = false;  ///< the grip button, or the key, is held since an edge: forces that are asked for do act
};

enum class WaitsFor : std::uint8_t { kNothing, kLine, kHold };

struct Turn {
  std::vector<std::string> say;             ///< lines, once
  glm::dvec3 force_N{0};                    ///< on the hand, in the frame of the samples; while the person holds
  WaitsFor waits_for = WaitsFor::kNothing;  ///< of the person
  bool is_over = false;
};

/// Only with good samples of a device in kReady; one step a millisecond.
class Procedure {
 public:
  virtual ~Procedure() = default;
  Procedure() = default;
  Procedure(const Procedure&) = delete;
  Procedure& operator=(const Procedure&) = delete;
  [[nodiscard]] virtual Turn step(std::int64_t now_ns, const Sample&, const Heard&) = 0;
  /// How it ended, as the program's exit status.
  [[nodiscard]] virtual int status() const = 0;
};

/// Of a device's base frame, as a person says it.
inline constexpr std::string_view kDirections[3][2] = {
    {"left", "right"}, {"towards you", "away from you"}, {"down", "up"}};

/// The axis along which a movement goes most, and which way.
struct MainAxis {
  int axis = 0, sign = 1;
  friend bool operator==(const MainAxis&, const MainAxis&) = default;
};
/// Nothing where it is shorter than `least`, or where another axis has more than half of it: then a person, or a
/// program, cannot be sure what was meant.
[[nodiscard]] std::optional<MainAxis> main_axis(const glm::dvec3& by, double least) noexcept;

/// How far a handle was moved, or deflected, at most, since it began.
class Movement {
 public:
  explicit Movement(bool is_rate) : is_rate_(is_rate) {}
  void begin(const Sample& from) noexcept;
  void add(const Sample&) noexcept;
  [[nodiscard]] const glm::dvec3& by() const noexcept { return by_; }  ///< [m], or a share of full deflection
  [[nodiscard]] double least() const noexcept { return is_rate_ ? kLeastShare : kLeast_m; }

  static constexpr double kLeast_m = 0.01, kLeastShare = 0.3;  ///< of a movement that is meant

 private:
  [[nodiscard]] glm::dvec3 where(const Sample&) const noexcept;
  bool is_rate_;
  glm::dvec3 from_{0}, by_{0};
};

/// "yes", "y", "Yes ": consent in words.
[[nodiscard]] bool is_yes(std::string_view line);

}  // namespace farfeel::devices
