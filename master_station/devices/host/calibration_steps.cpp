#include "master_station/devices/host/calibration_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace farfeel::devices {
namespace {

constexpr std::int64_t kNeutral_ns = 500'000'000;
constexpr double kForceRate_N_per_s = 0.4;  // slowly: dry friction is to let go, not a push
constexpr double kLifted_m = 0.002;         // so far it has moved against dry friction, and not in it
constexpr double kScaleLevel = 0.5;         // of a joystick's full force, against the scale
constexpr double kRise_s = 0.5;
constexpr double kGrams_N = 9.80665e-3;

bool skips(const std::string& line) {
  return line == "skip" || line == "s";
}

}  // namespace

tl::expected<glm::dmat3, std::string> axes_from(const std::array<glm::dvec3, 3>& moved_A, double least) {
  glm::dmat3 R_BA(0);
  for (int row = 0; row < 3; ++row) {
    const auto main = main_axis(moved_A[static_cast<std::size_t>(row)], least);
    const char* const way = kDirections[row][1].data();
    const glm::dvec3& by = moved_A[static_cast<std::size_t>(row)];
    if (!main)
      return tl::unexpected(
          fmt::format("the movement {} goes along no one axis: ({:.3f}, {:.3f}, {:.3f}), of which one "
                      "has to be {:.2f} at least and twice any other",
                      way, by.x, by.y, by.z, least));
    R_BA[main->axis][row] = main->sign;  // a column a driver's axis
  }
  for (int axis = 0; axis < 3; ++axis)
    if (glm::dot(R_BA[axis], R_BA[axis]) != 1)
      return tl::unexpected(std::string("two of the movements go along the same axis of the device"));
  if (glm::determinant(R_BA) < 0)
    return tl::unexpected(std::string("the three movements make a left-handed frame: one went the other way"));
  return R_BA;
}

CalibrationSteps::CalibrationSteps(const DeviceFile& before)
    : device_(before), movement_(before.model.tells == Tells::kRate) {}

double CalibrationSteps::cap_N() const noexcept {
  return device_.model.is_in_newtons ? kGravityShare * device_.model.continuous_force_N
                                     : kScaleLevel * device_.model.max_force_N;
}

void CalibrationSteps::ask_axes(Turn& turn, const Sample& sample) {
  part_ = Part::kAxes;
  movement_.begin(sample);
  turn.say.push_back(fmt::format("Move the handle {} by {}, then press Enter{}.", kDirections[axis_][1],
                                 device_.model.tells == Tells::kRate ? "more than a third of its way" : "3 cm or more",
                                 axis_ == 0 ? "; or type skip to leave the axes as they are" : ""));
}

void CalibrationSteps::ask_middle(Turn& turn) {
  if (device_.model.tells == Tells::kRate) {
    part_ = Part::kNeutral;
    since_ns_ = 0;
    turn.say.push_back("Let go of it, and press Enter.");
  } else {
    part_ = Part::kMiddle;
    turn.say.push_back(
        "Hold the handle in the middle of where you want to work, and press Enter; or type skip to leave the middle.");
  }
}

void CalibrationSteps::ask_gravity(Turn& turn) {
  force_N_ = lifted_N_ = 0;
  was_held_ = false;
  const char* const hold = device_.model.enable_button >= 0 ? "grip button" : "space bar";
  if (device_.model.force_dof >= 3 && device_.model.is_in_newtons) {
    part_ = Part::kLift;
    turn.say.push_back(fmt::format(
        "Now the force that holds the handle up. It pushes up slowly, with {:.2f} N at most, while you hold the {} and "
        "let the handle rest; then it lets the handle down. Hold, or type skip.",
        cap_N(), hold));
  } else if (device_.model.force_dof > 0 && !device_.model.is_in_newtons) {
    part_ = Part::kScale;
    turn.say.push_back(fmt::format(
        "What is its force in newtons? Put a kitchen scale to the right of the handle, upright, and hold the "
        "{}: it pushes right with half of its force. Type what the scale shows, in grams, while it pushes; or "
        "skip.",
        hold));
  } else {
    ask_accept(turn);
  }
}

void CalibrationSteps::ask_accept(Turn& turn) {
  part_ = Part::kAccept;
  turn.say.push_back("Type yes to keep this.");
}

void CalibrationSteps::axes(Turn& turn, const Sample& sample, const std::string& line) {
  if (axis_ == 0 && skips(line)) {
    ask_middle(turn);
    return;
  }
  moved_A_[static_cast<std::size_t>(axis_)] = movement_.by();
  if (++axis_ < 3 && axis_ < device_.model.position_dof) {
    ask_axes(turn, sample);
    return;
  }
  // Of a device with fewer axes, the others are what is left of a right-handed frame.
  if (axis_ == 1) moved_A_[1] = {-moved_A_[0].y, moved_A_[0].x, 0};
  if (axis_ < 3) moved_A_[2] = glm::cross(moved_A_[0], moved_A_[1]) / std::max(movement_.least(), 1e-9) * 10.0;
  axis_ = 0;
  if (const auto R_BA = axes_from(moved_A_, movement_.least())) {
    device_.calibration.R_BA = *R_BA;
    device_.calibration.offset_B_m = glm::dvec3(0);
    turn.say.push_back("  The axes are clear.");
    ask_middle(turn);
  } else {
    turn.say.push_back(fmt::format("  Refused: {}. Once more.", R_BA.error()));
    ask_axes(turn, sample);
  }
}

void CalibrationSteps::middle(Turn& turn, const Sample& sample, const std::string& line) {
  if (!skips(line)) {
    const glm::dvec3 offset_m = -(device_.calibration.R_BA * sample.X_BD.p);
    const double most_m = glm::length(offset_m);
    if (!(most_m <= kMostOffset_m)) {
      turn.say.push_back(
          fmt::format("  Refused: the middle would be {:.3f} m from the device's own, of {:.1f} m at "
                      "most. Is the device homed?",
                      most_m, kMostOffset_m));
      return;
    }
    device_.calibration.offset_B_m = offset_m;
    turn.say.push_back("  The middle is kept.");
  }
  ask_gravity(turn);
}

void CalibrationSteps::neutral(Turn& turn, std::int64_t now_ns, const Sample& sample) {
  sum_.turn += sample.deflection.turn;
  sum_.push += sample.deflection.push;
  ++samples_;
  if (now_ns - since_ns_ < kNeutral_ns) return;
  const Deflection mean{sum_.turn / static_cast<double>(samples_), sum_.push / static_cast<double>(samples_)};
  const double most = std::max({std::abs(mean.turn.x), std::abs(mean.turn.y), std::abs(mean.turn.z),
                                std::abs(mean.push.x), std::abs(mean.push.y), std::abs(mean.push.z)});
  if (!(most <= kMostNeutral)) {
    turn.say.push_back(
        fmt::format("  Refused: let go, it is deflected by {:.2f} of its way, of {:.2f} at most.", most, kMostNeutral));
    ask_middle(turn);
    return;
  }
  device_.calibration.neutral = mean;
  turn.say.push_back(fmt::format("  The neutral point is kept; {:.3f} of the way off at most.", most));
  ask_gravity(turn);
}

void CalibrationSteps::lift(Turn& turn, std::int64_t now_ns, const Sample& sample, const Heard& heard) {
  const glm::dvec3 up_A = glm::dvec3(0, 0, 1) * device_.calibration.R_BA;  // by the transpose
  const double height_m = glm::dot(up_A, sample.X_BD.p);
  if (!heard.is_held) {
    force_N_ = 0;
    was_held_ = false;
    return;
  }
  if (!was_held_) {
    was_held_ = true;
    from_m_ = height_m;
    last_ns_ = now_ns;
  }
  from_m_ = std::min(from_m_, height_m);  // it may still sink
  force_N_ += kForceRate_N_per_s * static_cast<double>(now_ns - last_ns_) * 1e-9;
  last_ns_ = now_ns;
  if (height_m - from_m_ > kLifted_m) {
    lifted_N_ = force_N_;
    from_m_ = height_m;
    part_ = Part::kSink;
  } else if (force_N_ > cap_N()) {
    turn.say.push_back(
        fmt::format("  Refused: {:.2f} N, half of what the device gives for ever, do not lift it. Is "
                    "something in its way? The weight stays as it was.",
                    cap_N()));
    ask_accept(turn);
    return;
  }
  turn.force_N = force_N_ * up_A;
}

void CalibrationSteps::sink(Turn& turn, std::int64_t now_ns, const Sample& sample, const Heard& heard) {
  const glm::dvec3 up_A = glm::dvec3(0, 0, 1) * device_.calibration.R_BA;
  const double height_m = glm::dot(up_A, sample.X_BD.p);
  if (!heard.is_held) {  // let go too early: from the beginning
    ask_gravity(turn);
    return;
  }
  from_m_ = std::max(from_m_, height_m);  // it may still rise
  force_N_ = std::max(force_N_ - kForceRate_N_per_s * static_cast<double>(now_ns - last_ns_) * 1e-9, 0.0);
  last_ns_ = now_ns;
  turn.force_N = force_N_ * up_A;
  // Dry friction holds it both ways: its weight lies in the middle.
  if (from_m_ - height_m > kLifted_m || force_N_ <= 0) gravity(turn, 0.5 * (lifted_N_ + force_N_));
}

void CalibrationSteps::gravity(Turn& turn, double force_N) {
  if (force_N > std::min(cap_N(), kMostGravity_N)) {
    turn.say.push_back(fmt::format("  Refused: a weight of {:.2f} N, of {:.2f} N at most.", force_N,
                                   std::min(cap_N(), kMostGravity_N)));
  } else {
    device_.calibration.gravity_B_N = {0, 0, force_N};
    turn.say.push_back(fmt::format("  It takes {:.2f} N to hold the handle up.", force_N));
  }
  ask_accept(turn);
}

void CalibrationSteps::scale(Turn& turn, const std::string& line) {
  if (skips(line)) {
    turn.say.push_back("  It stays without newtons: its force is a share of the greatest.");
    ask_accept(turn);
    return;
  }
  double grams = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), grams);
  const double full_N = grams * kGrams_N / kScaleLevel;
  if (error != std::errc() || end == line.data() || !(full_N >= kLeastFull_N && full_N <= kMostFull_N)) {
    turn.say.push_back(
        fmt::format("  Refused: \"{}\" would be {:.3f} N at full force, of {:.1f} to {:.0f} N. Type "
                    "grams, or skip.",
                    line, full_N, kLeastFull_N, kMostFull_N));
    return;
  }
  DeviceModel& model = device_.model;
  const double newtons_per_unit = full_N / model.max_force_N;
  model.continuous_force_N *= newtons_per_unit;
  model.max_force_N = full_N;
  device_.calibration.units_per_N = 1 / newtons_per_unit;
  model.is_in_newtons = true;
  turn.say.push_back(fmt::format("  Full force is {:.2f} N.", full_N));
  ask_accept(turn);
}

Turn CalibrationSteps::step(std::int64_t now_ns, const Sample& sample, const Heard& heard) {
  Turn turn;
  switch (part_) {
    case Part::kBegin:
      ask_axes(turn, sample);
      break;
    case Part::kAxes:
      movement_.add(sample);
      if (heard.line) axes(turn, sample, *heard.line);
      break;
    case Part::kMiddle:
      if (heard.line) middle(turn, sample, *heard.line);
      break;
    case Part::kNeutral:
      if (since_ns_ != 0) {
        neutral(turn, now_ns, sample);
      } else if (heard.line) {
        since_ns_ = now_ns;
        samples_ = 0;
        sum_ = {};
      }
      break;
    case Part::kLift:
      if (heard.line && skips(*heard.line)) {
        ask_accept(turn);
      } else {
        lift(turn, now_ns, sample, heard);
      }
      break;
    case Part::kSink:
      sink(turn, now_ns, sample, heard);
      break;
    case Part::kScale: {
      const double t_s = heard.is_held && was_held_ ? static_cast<double>(now_ns - since_ns_) * 1e-9 : 0;
      if (heard.is_held && !was_held_) since_ns_ = now_ns;
      was_held_ = heard.is_held;
      const glm::dvec3 right_A = glm::dvec3(1, 0, 0) * device_.calibration.R_BA;
      turn.force_N = kScaleLevel * device_.model.max_force_N * std::clamp(t_s / kRise_s, 0.0, 1.0) * right_A;
      if (heard.line && !heard.line->empty()) scale(turn, *heard.line);
      break;
    }
    case Part::kAccept:
      if (!heard.line) break;
      is_accepted_ = is_yes(*heard.line);
      if (!is_accepted_) turn.say.push_back("Nothing is kept.");
      turn.is_over = true;
      break;
  }
  const bool waits_for_hold = part_ == Part::kLift || part_ == Part::kSink;
  turn.waits_for = waits_for_hold                              ? WaitsFor::kHold
                   : part_ == Part::kNeutral && since_ns_ != 0 ? WaitsFor::kNothing
                                                               : WaitsFor::kLine;
  return turn;
}

}  // namespace farfeel::devices
