#include "master_station/devices/host/held_force.h"

#include <cmath>

namespace farfeel::devices {

bool HeldForce::next(std::int64_t now_ns, const Sample& sample, bool is_key_held) noexcept {
  const std::int64_t alive_ns = model_.reports == Reports::kStream ? sample.time_ns : sample.polled_ns;
  // Another opening: force was off meanwhile, and it takes a new edge.
  const bool is_same = sample.opening == opening_;
  opening_ = sample.opening;
  const bool is_allowed = is_same && sample.stage == Stage::kReady && now_ns - alive_ns <= kStaleSample_ns;
  const bool is_down =
      model_.enable_button >= 0 ? sample.has_button(static_cast<unsigned>(model_.enable_button)) : is_key_held;
  return deadman_.next(is_allowed, is_down);
}

Command HeldForce::command(std::int64_t now_ns, const glm::dvec3& force_N) const noexcept {
  Command command;
  command.time_ns = now_ns;
  command.opening = opening_;
  const double length_N = glm::length(force_N);
  command.is_force_on = deadman_.is_on() && std::isfinite(length_N);
  if (command.is_force_on) command.F_hand_B.force_N = length_N > cap_N_ ? force_N * (cap_N_ / length_N) : force_N;
  return command;
}

}  // namespace farfeel::devices
