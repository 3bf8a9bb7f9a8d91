#include "master_station/devices/host/force_test.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace farfeel::devices {
namespace {

constexpr double kRise_s = 0.3, kPush_s = 1.2;  // up, and up to the end, which comes down as it rose
constexpr double kLeastRate = 0.5;              // of the rate that the model's data tells
constexpr std::string_view kLetters[3] = {"lr", "ta", "du"};

}  // namespace

ForceTest::ForceTest(const DeviceModel& model, bool has_consent)
    : model_(model),
      has_consent_(has_consent),
      force_N_(std::min(kMost_N,
                        kMostShare * (model.continuous_force_N > 0 ? model.continuous_force_N : model.max_force_N))),
      movement_(model.tells == Tells::kRate) {}

void ForceTest::check(Turn& turn, bool is_good, const std::string& what) {
  ++(is_good ? good_ : failed_);
  turn.say.push_back(fmt::format("  {} {}", is_good ? "good: " : "WRONG:", what));
}

void ForceTest::ask_to_move(Turn& turn, const Sample& sample) {
  movement_.begin(sample);
  turn.say.push_back(fmt::format("Move the handle {} by {}, then press Enter.", kDirections[axis_][1],
                                 model_.tells == Tells::kRate ? "more than a third of its way" : "3 cm or more"));
}

void ForceTest::ask_to_hold(Turn& turn) {
  part_ = Part::kHold;
  turn.say.push_back(fmt::format("Hold the {}: it pushes you softly for a second.",
                                 model_.enable_button >= 0 ? "grip button" : "space bar"));
}

void ForceTest::after_moves(Turn& turn) {
  if (model_.force_dof == 0 || force_N_ <= 0) {
    part_ = Part::kVerdict;
    return;
  }
  axis_ = 0;
  sign_ = 1;
  if (has_consent_) {
    ask_to_hold(turn);
    return;
  }
  part_ = Part::kConsent;
  turn.say.push_back(
      fmt::format("Next the device pushes your hand with at most {:.2f} {} along each axis, only while "
                  "you hold. Type yes to consent.",
                  force_N_, model_.is_in_newtons ? "N" : "of its own units"));
}

void ForceTest::answer(Turn& turn, const std::string& line) {
  const char letter = line.empty() ? 'n' : line[0];
  const char expected = kLetters[axis_][sign_ > 0 ? 1 : 0];
  std::string felt = "nothing";
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      if (letter == kLetters[axis][static_cast<std::size_t>(side)]) felt = kDirections[axis][side];
  check(turn, letter == expected,
        fmt::format("it pushed {}, you felt {}", kDirections[axis_][sign_ > 0 ? 1 : 0], felt));
  sign_ = -sign_;
  if (sign_ > 0) ++axis_;
  if (axis_ < std::min(model_.force_dof, 3)) {
    ask_to_hold(turn);
  } else {
    part_ = Part::kVerdict;
  }
}

void ForceTest::verdict(Turn& turn, std::int64_t now_ns, const Sample& sample) {
  const double past_s = static_cast<double>(now_ns - begun_ns_) * 1e-9;
  const double rate_Hz = past_s > 0 ? static_cast<double>(sample.reports - first_report_) / past_s : 0;
  if (model_.reports == Reports::kStream && model_.rate_Hz > 0) {
    check(turn, rate_Hz >= kLeastRate * model_.rate_Hz,
          fmt::format("{:.0f} reports a second of {:.0f}", rate_Hz, model_.rate_Hz));
  }
  if (model_.enable_button >= 0)
    check(turn, ((buttons_ >> model_.enable_button) & 1U) != 0,
          fmt::format("button {}, which enables force, was seen", model_.enable_button));
  turn.say.push_back(failed_ == 0 ? fmt::format("All {} checks are good.", good_)
                                  : fmt::format("{} of {} checks are wrong: run farfeel device calibrate, and do not "
                                                "use force before the test is good.",
                                                failed_, failed_ + good_));
  is_over_ = turn.is_over = true;
}

Turn ForceTest::step(std::int64_t now_ns, const Sample& sample, const Heard& heard) {
  Turn turn;
  buttons_ |= sample.buttons;
  if (part_ == Part::kBegin) {
    begun_ns_ = now_ns;
    first_report_ = sample.reports;
    part_ = Part::kMoves;
    if (std::max(model_.position_dof, 0) == 0) {
      after_moves(turn);
    } else {
      ask_to_move(turn, sample);
    }
    return turn;
  }
  switch (part_) {
    case Part::kMoves: {
      movement_.add(sample);
      if (!heard.line) break;
      const auto moved = main_axis(movement_.by(), movement_.least());
      check(turn, moved == MainAxis{axis_, 1},
            fmt::format("you moved it {}, it tells {}", kDirections[axis_][1],
                        moved ? kDirections[moved->axis][moved->sign > 0 ? 1 : 0] : "no one direction"));
      if (++axis_ < std::min(model_.position_dof, 3)) {
        ask_to_move(turn, sample);
      } else {
        after_moves(turn);
      }
      break;
    }
    case Part::kConsent:
      if (!heard.line) break;
      if (is_yes(*heard.line)) {
        ask_to_hold(turn);
      } else {
        turn.say.push_back("No consent, no force.");
        part_ = Part::kVerdict;
      }
      break;
    case Part::kHold:
      if (!heard.is_held) break;
      pushed_ns_ = 0;
      last_ns_ = now_ns;
      part_ = Part::kPush;
      break;
    case Part::kPush: {
      if (!heard.is_held) {  // let go: once more from the beginning
        ask_to_hold(turn);
        break;
      }
      pushed_ns_ += now_ns - last_ns_;
      last_ns_ = now_ns;
      const double t_s = static_cast<double>(pushed_ns_) * 1e-9;
      turn.force_N[axis_] = sign_ * force_N_ * std::clamp(std::min(t_s, kPush_s - t_s) / kRise_s, 0.0, 1.0);
      if (t_s < kPush_s) break;
      part_ = Part::kAnswer;
      turn.say.push_back(
          "Where did it push? r right, l left, a away from you, t towards you, u up, d down, n nothing; then Enter.");
      break;
    }
    case Part::kAnswer:
      if (heard.line) answer(turn, *heard.line);
      break;
    case Part::kVerdict:
      verdict(turn, now_ns, sample);
      break;
    case Part::kBegin:
      break;
  }
  turn.waits_for = part_ == Part::kHold                                                         ? WaitsFor::kHold
                   : part_ == Part::kMoves || part_ == Part::kConsent || part_ == Part::kAnswer ? WaitsFor::kLine
                                                                                                : WaitsFor::kNothing;
  return turn;
}

}  // namespace farfeel::devices
