// What a person and a device do together, with both in software: no terminal, no hardware, no clock.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "master_station/devices/host/calibration_steps.h"
#include "master_station/devices/host/force_test.h"
#include "master_station/devices/host/held_force.h"
#include "master_station/devices/host/limits_steps.h"
#include "tests/support/devices/simulated_axis.h"

namespace farfeel::devices {
namespace {

constexpr std::int64_t kTick_ns = 1'000'000;

DeviceModel pusher() {
  DeviceModel model;
  model.name = model.title = "pusher";
  model.position_dof = model.force_dof = 3;
  model.max_force_N = 8;
  model.continuous_force_N = 4;
  model.viscous_friction_Ns_per_m = 2;
  model.position_step_m = 20e-6;
  model.enable_button = 0;
  model.enabling = Enabling::kHold;
  return model;
}

/// A person who does and says what the last line asks for, and a handle that goes where it is pushed.
struct Room {
  Sample sample;
  bool is_held = true;
  std::int64_t now_ns = 0;
  std::vector<std::string> said;
  double most_N = 0;
  bool has_pushed_unheld = false;

  /// `person` is called with each line, and says what is typed next.
  void run(Procedure& procedure, const std::function<std::optional<std::string>(const std::string&)>& person,
           const std::function<void(const glm::dvec3&)>& world = {}, int seconds = 200) {
    std::optional<std::string> typed;
    for (int i = 0; i < seconds * 1000; ++i) {
      now_ns += kTick_ns;
      sample.time_ns = sample.polled_ns = now_ns;
      sample.stage = Stage::kReady;
      ++sample.reports;
      const Turn turn = procedure.step(now_ns, sample, {std::exchange(typed, {}), is_held});
      most_N = std::max(most_N, glm::length(turn.force_N));
      if (world) world(turn.force_N);
      for (const std::string& line : turn.say) {
        said.push_back(line);
        if (auto words = person(line)) typed = words;
      }
      if (turn.is_over) return;
    }
    ADD_FAILURE() << "it never ends; last: " << (said.empty() ? "" : said.back());
  }
  [[nodiscard]] bool has_said(const std::string& part) const {
    for (const std::string& line : said)
      if (line.find(part) != std::string::npos) return true;
    return false;
  }
};

bool holds(const std::string& line, const char* part) {
  return line.find(part) != std::string::npos;
}

/// Moves the handle as it is asked to, in a driver's frame that R_BA maps.
bool moves(const std::string& line, const glm::dmat3& R_BA, Sample& sample) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!holds(line, (std::string("handle ") + kDirections[axis][1].data()).c_str())) continue;
    glm::dvec3 by_B(0);
    by_B[axis] = 0.04;
    sample.X_BD.p += by_B * R_BA + glm::dvec3(0.004, -0.003, 0.002);  // no hand moves straight
    return true;
  }
  return false;
}

TEST(ForceTest, OfAGoodDeviceIsGoodAndPushesWeakly) {
  DeviceModel model = pusher();
  model.rate_Hz = 1000;
  ForceTest test(model, false);
  Room room;
  glm::dvec3 last_N(0), push_N(0);
  room.sample.buttons = 1;
  room.run(
      test,
      [&](const std::string& line) -> std::optional<std::string> {
        if (moves(line, glm::dmat3(1), room.sample)) return "";
        if (holds(line, "yes to consent")) return "yes";
        if (holds(line, "Where did it push")) {
          const auto pushed = main_axis(push_N, 0.1);
          push_N = glm::dvec3(0);
          return pushed ? std::string(1, "lrtadu"[2 * pushed->axis + (pushed->sign > 0 ? 1 : 0)]) : "n";
        }
        return std::nullopt;
      },
      [&](const glm::dvec3& force_N) {
        if (glm::length(force_N) > glm::length(push_N)) push_N = force_N;
        EXPECT_LT(glm::length(force_N - last_N), 0.01) << "it rises and falls softly";
        last_N = force_N;
      });
  EXPECT_EQ(test.status(), 0) << room.said.back();
  EXPECT_NEAR(room.most_N, 0.8, 1e-6) << "a fifth of 4 N";
  EXPECT_TRUE(room.has_said("All 11 checks are good")) << room.said.back();
}

TEST(ForceTest, TellsAnAxisThatIsSwappedAndAForceThatPointsTheOtherWay) {
  ForceTest test(pusher(), true);
  Room room;
  room.run(test, [&](const std::string& line) -> std::optional<std::string> {
    if (moves(line, glm::dmat3(0, 1, 0, 1, 0, 0, 0, 0, -1), room.sample)) return "";
    if (holds(line, "Where did it push")) return "u";
    return std::nullopt;
  });
  EXPECT_EQ(test.status(), 1);
  EXPECT_TRUE(room.has_said("WRONG: you moved it right, it tells away from you"));
  EXPECT_TRUE(room.has_said("WRONG: it pushed right, you felt up"));
  EXPECT_TRUE(room.has_said("do not use force"));
}

TEST(ForceTest, WithoutConsentThereIsNoForce) {
  ForceTest test(pusher(), false);
  Room room;
  room.run(test, [&](const std::string& line) -> std::optional<std::string> {
    moves(line, glm::dmat3(1), room.sample);
    return "perhaps";
  });
  EXPECT_EQ(room.most_N, 0);
  EXPECT_TRUE(room.has_said("No consent, no force"));
}

TEST(HeldForce, LetsThroughOnlyWhatIsHeldFromAnEdgeFreshAndFinite) {
  HeldForce held(pusher(), 1);
  Sample sample;
  sample.stage = Stage::kReady;
  sample.opening = 1;
  std::int64_t now_ns = 0;
  const auto next = [&](std::uint32_t buttons, std::int64_t age_ns = 0) {
    now_ns += kTick_ns;
    sample.time_ns = now_ns - age_ns;
    sample.buttons = buttons;
    return held.next(now_ns, sample, true);
  };
  EXPECT_FALSE(next(1));
  EXPECT_FALSE(next(1)) << "down from the start is no edge";
  EXPECT_FALSE(next(0));
  EXPECT_TRUE(next(1));
  EXPECT_NEAR(glm::length(held.command(now_ns, {3, 4, 0}).F_hand_B.force_N), 1, 1e-12);
  EXPECT_FALSE(held.command(now_ns, {std::numeric_limits<double>::quiet_NaN(), 0, 0}).is_force_on);
  EXPECT_FALSE(next(1, 21 * kTick_ns)) << "stale";
  EXPECT_FALSE(next(1)) << "and that takes a new edge";
  EXPECT_FALSE(held.command(now_ns, {1, 0, 0}).is_force_on);
  EXPECT_FALSE(next(0));
  EXPECT_TRUE(next(1));
  sample.opening = 2;
  EXPECT_FALSE(next(1)) << "plugged in anew";
  EXPECT_FALSE(next(1));
}

TEST(AxesFrom, FindsEveryRightHandedMappingAndNoOther) {
  int right_handed = 0;
  for (int first = 0; first < 3; ++first) {
    for (int second = 0; second < 3; ++second) {
      for (int signs = 0; signs < 8; ++signs) {
        if (first == second) continue;
        glm::dmat3 R_BA(0);
        R_BA[first][0] = (signs & 1) != 0 ? 1 : -1;
        R_BA[second][1] = (signs & 2) != 0 ? 1 : -1;
        R_BA[3 - first - second][2] = (signs & 4) != 0 ? 1 : -1;
        const auto column = [&](int axis) {  // what A sees of a movement along B's axis
          glm::dvec3 by(0);
          by[axis] = 0.05;
          return by * R_BA + glm::dvec3(0.005, -0.01, 0.008);
        };
        const auto found = axes_from({column(0), column(1), column(2)}, 0.01);
        if (glm::determinant(R_BA) > 0) {
          ASSERT_TRUE(found) << found.error();
          EXPECT_EQ(*found, R_BA);
          ++right_handed;
        } else {
          ASSERT_FALSE(found);
          EXPECT_TRUE(holds(found.error(), "left-handed"));
        }
      }
    }
  }
  EXPECT_EQ(right_handed, 24);
  EXPECT_FALSE(axes_from({glm::dvec3(0.05, 0.04, 0), {0, 0.05, 0}, {0, 0, 0.05}}, 0.01)) << "between two axes";
  EXPECT_FALSE(axes_from({glm::dvec3(0.05, 0, 0), {0.05, 0, 0}, {0, 0, 0.05}}, 0.01)) << "twice the same";
  EXPECT_FALSE(axes_from({glm::dvec3(0.005, 0, 0), {0, 0.05, 0}, {0, 0, 0.05}}, 0.01)) << "too short";
  EXPECT_FALSE(axes_from({glm::dvec3(std::nan(""), 0, 0), {0, 0.05, 0}, {0, 0, 0.05}}, 0.01));
}

TEST(CalibrationSteps, FindAxesMiddleAndTheWeightOfTheHandleDespiteDryFriction) {
  const glm::dmat3 R_BA(glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0));
  const glm::dvec3 up_A = glm::transpose(R_BA)[2];
  constexpr double kWeight_N = 0.6, kDry_N = 0.2;
  DeviceFile before;
  before.model = pusher();
  CalibrationSteps steps(before);
  Room room;
  room.run(
      steps,
      [&](const std::string& line) -> std::optional<std::string> {
        if (moves(line, R_BA, room.sample)) return "";
        if (holds(line, "in the middle")) return "";
        if (holds(line, "Type yes")) return "yes";
        return std::nullopt;
      },
      [&](const glm::dvec3& force_A_N) {  // slow: it moves as fast as force beyond dry friction lets it
        const double up_N = (R_BA * force_A_N).z - kWeight_N;
        const bool rests = (R_BA * room.sample.X_BD.p).z < 0.0 && up_N < 0;  // on the table
        const double beyond_N = std::max(std::abs(up_N) - kDry_N, 0.0);
        if (!rests) room.sample.X_BD.p += std::copysign(beyond_N * 2e-4, up_N) * up_A;
      });
  ASSERT_TRUE(steps.result()) << room.said.back();
  const Calibration found = steps.result()->calibration;
  EXPECT_EQ(found.R_BA, R_BA);
  EXPECT_NEAR(found.gravity_B_N.z, kWeight_N, 0.06);
  EXPECT_LE(room.most_N, 2) << "half of what it gives for ever";
  EXPECT_GT(glm::length(found.offset_B_m), 0);
}

TEST(CalibrationSteps, RefuseWhatNoHandleWeighsWithTheFigure) {
  DeviceFile before;
  before.model = pusher();
  CalibrationSteps steps(before);
  Room room;
  room.run(steps, [&](const std::string& line) -> std::optional<std::string> {
    if (holds(line, "skip to leave")) return "skip";
    if (holds(line, "Type yes")) return "no";
    return std::nullopt;
  });
  EXPECT_TRUE(room.has_said("Refused: 2.00 N, half of what the device gives"));
  EXPECT_FALSE(steps.result());
  EXPECT_EQ(steps.status(), 1);
}

TEST(CalibrationSteps, GiveAJoystickItsNewtonsByAKitchenScale) {
  DeviceFile before;
  before.model = pusher();
  before.model.is_in_newtons = false;
  before.model.force_dof = before.model.position_dof = 2;
  before.model.max_force_N = 1;
  before.model.continuous_force_N = 0.5;
  CalibrationSteps steps(before);
  Room room;
  bool was_refused = false;
  room.run(steps, [&](const std::string& line) -> std::optional<std::string> {
    if (holds(line, "skip to leave")) return "skip";
    if (holds(line, "kitchen scale")) return "200 kg";  // reads as 200 grams: a unit it does not ask for
    if (holds(line, "Refused")) was_refused = true;
    if (holds(line, "Type yes")) return "yes";
    return std::nullopt;
  });
  ASSERT_TRUE(steps.result());
  EXPECT_TRUE(steps.result()->model.is_in_newtons);
  EXPECT_NEAR(steps.result()->model.max_force_N, 2 * 0.2 * 9.80665, 1e-3);
  EXPECT_NEAR(steps.result()->model.continuous_force_N, 0.2 * 9.80665, 1e-3);
  EXPECT_FALSE(was_refused);
  spatial::Wrench one;
  one.force_N = {1, 0, 0};
  EXPECT_NEAR(for_device(steps.result()->calibration, one).force_N.x, 1 / (2 * 0.2 * 9.80665), 1e-3)
      << "the driver's unit is its full force: a newton has to stay one";

  CalibrationSteps wrong(before);
  Room other;
  int asked = 0;
  other.run(wrong, [&](const std::string& line) -> std::optional<std::string> {
    if (holds(line, "skip to leave")) return "skip";
    if (holds(line, "kitchen scale")) return "1e9";
    if (holds(line, "Refused")) return ++asked == 1 ? "-5" : asked == 2 ? "heavy" : "skip";
    if (holds(line, "Type yes")) return "yes";
    return std::nullopt;
  });
  EXPECT_EQ(asked, 3);
  ASSERT_TRUE(wrong.result());
  EXPECT_FALSE(wrong.result()->model.is_in_newtons) << "it stays honest";
}

TEST(LimitsSteps, WriteTheSoftestAxisOfAllWithItsDamping) {
  DeviceFile before;
  before.model = pusher();
  before.model.force_dof = 2;
  before.model.actuator_delay_s = 0;
  before.model.rate_Hz = 0;
  LimitsSteps steps(before, false);
  std::array<test_support::SimulatedAxis::Figures, 2> figures;
  figures[0].actuator_ticks = 1;
  figures[0].coulomb_N = 0.1;
  figures[0].step_m = 20e-6;
  figures[1] = figures[0];
  figures[1].viscous_Ns_per_m = 1.2;
  std::array axes{test_support::SimulatedAxis(figures[0]), test_support::SimulatedAxis(figures[1])};
  Room room;
  room.run(
      steps,
      [&](const std::string& line) -> std::optional<std::string> {
        return holds(line, "yes to consent") ? std::optional<std::string>("yes") : std::nullopt;
      },
      [&](const glm::dvec3& force_N) {
        for (int i = 0; i < 2; ++i) {
          axes[static_cast<std::size_t>(i)].push(force_N[i]);
          room.sample.X_BD.p[i] = axes[static_cast<std::size_t>(i)].told_m();
          room.sample.V_BD_B.linear_m_s[i] = axes[static_cast<std::size_t>(i)].told_m_s();
        }
      },
      600);
  ASSERT_TRUE(steps.result()) << room.said.back();
  EXPECT_EQ(steps.result()->model.coupling_damping_Ns_per_m, 0.5);
  const double truth = test_support::stiffest_calm_N_per_m(figures[1], 0.5);
  EXPECT_GE(steps.result()->model.coupling_stiffness_N_per_m, 0.55 * truth);
  EXPECT_LE(steps.result()->model.coupling_stiffness_N_per_m, 0.75 * truth);
}

TEST(LimitsSteps, WithoutConsentOrNewtonsThereIsNoKick) {
  DeviceFile before;
  before.model = pusher();
  LimitsSteps unwilling(before, false);
  Room room;
  room.run(unwilling, [](const std::string&) { return std::optional<std::string>("no"); });
  EXPECT_EQ(room.most_N, 0);
  EXPECT_FALSE(unwilling.result());
  before.model.is_in_newtons = false;
  LimitsSteps joystick(before, true);
  Room other;
  other.run(joystick, [](const std::string&) { return std::optional<std::string>(); });
  EXPECT_EQ(other.most_N, 0);
  EXPECT_EQ(joystick.status(), 1);
}

}  // namespace
}  // namespace farfeel::devices
