// Closed paths of a tool through contacts that are clustered anew all along. Frozen, a contact makes no energy; what
// this makes is for the operator's tank to pay as it lets the change in (local_model/transition.h), and has a stated
// bound.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "slave_sim/models/height_plate.h"
#include "tests/bench/hardcases_contact.h"
#include "tests/support/solids.h"
#include "tests/support/textured_solids.h"

namespace farfeel::bench {
namespace {

using contact::ContactSet;
using spatial::Pose;

/// Of the greatest energy that the contacts stored on the way.
constexpr double kMostMade = 0.25;
constexpr double kTurn = 2 * std::numbers::pi;

struct Round {
  double made_J = 0, stored_J = 0, largest_step_J = 0;
};

double stored_J(const ContactSet& set) {
  double sum = 0;
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const contact::Contact& c = set.contacts[i];
    sum += 0.5 * c.material.stiffness_N_per_m * std::pow(std::max(c.depth_m, 0.0), 2);
  }
  return sum;
}

/// Twice along path(phase), phase from 0 to 1, at 1 kHz; the second time counts.
Round go_round(const Touching& pair, const std::function<Pose(double)>& path, int frames) {
  contact_service::ContactService service = pair.service();
  Round round;
  spatial::Wrench last;
  Pose before;
  double last_J = 0;
  for (int i = 0; i <= 2 * frames; ++i) {
    const Pose pose = path(static_cast<double>(i % frames) / frames);
    const ContactSet& set = service.answer(pose_number(static_cast<std::uint32_t>(i), pose));
    const double now_J = stored_J(set);
    if (i > frames) {
      const spatial::Twist moved{spatial::vector_from_rotation(pose.R * glm::conjugate(before.R)), pose.p - before.p};
      round.made_J += 0.5 * spatial::power_W(last + set.F_To_W, moved);
      round.largest_step_J = std::max(round.largest_step_J, std::abs(now_J - last_J));
      round.stored_J = std::max(round.stored_J, now_J);
    }
    last = set.F_To_W, before = pose, last_J = now_J;
  }
  return round;
}

void judge(HardCaseRows& rows, const std::string& name, const Round& round) {
  rows.push_back(
      {name, "energy made, of the greatest stored", 100 * round.made_J / round.stored_J, "%", 100 * kMostMade});
  rows.push_back({name, "energy made", 1e6 * round.made_J, "uJ", 1e6 * kMostMade * round.stored_J});
}

/// A textured nut is screwed onto its bolt and off again, pressed against the upper flanks: on the way contacts that
/// are height fields become contacts that are felt as points, and back.
void screwed_on_and_off(HardCaseRows& rows) {
  constexpr double kClearance_m = 0.1e-3, kPressed_m = 0.1e-3;
  const support::Thread thread{
      .radius_m = 4e-3, .depth_m = 1.3e-3, .pitch_m = 1.5e-3, .turns = 1, .sides = 12, .steps = 4};
  const auto ridges = [](const glm::dvec3& p) {
    return 0.02e-3 * (std::cos(kTurn * std::hypot(p.x, p.y) / 0.5e-3) - 1);
  };
  const Touching pair{.s = support::textured(support::bolt_mesh(thread), ridges),
                      .t = support::textured(support::nut_mesh(thread, kClearance_m, 3), ridges),
                      .tolerance_m = 0.5e-3,
                      .X_WO = {}};
  const double slope = 2 * thread.depth_m / thread.pitch_m,
               up_m = (kClearance_m + kPressed_m * std::hypot(1, slope)) / slope;
  judge(rows, "forth and back: a textured nut on its bolt",
        go_round(
            pair,
            [&](double phase) {
              const double turn =
                  1.45 + 0.65 * std::cos(kTurn * phase);  // from all of the bolt's thread in the nut to little
              return Pose{spatial::rotation_from_vector({0, 0, kTurn * (turn - std::round(turn))}),
                          {0, 0, up_m + thread.pitch_m * turn}};
            },
            160));
}

void peg_round_its_hole(HardCaseRows& rows) {
  const Touching pair{.s = support::untextured(support::tube_mesh(0.010, 0.016, 0.020, 48)),
                      .t = support::untextured(support::cylinder_mesh(0.0097, 0.030, 48)),
                      .tolerance_m = 2e-3,
                      .X_WO = {}};
  judge(rows, "closed path: a peg round its hole",
        go_round(
            pair,
            [](double phase) {
              const double angle = kTurn * phase, aside_m = 0.5e-3 + 0.1e-3 * std::cos(3 * angle);
              return Pose{{1, 0, 0, 0}, aside_m * glm::dvec3{std::cos(angle), std::sin(angle), 0}};
            },
            2000));
}

void ridges_over_ridges(HardCaseRows& rows) {
  const Touching pair{.s = slave_sim::ridged_plate(3e-3, 0.5e-3, {.size_m = {0.030, 0.030, 0.004}}),
                      .t = slave_sim::ridged_plate(2e-3, 0.3e-3, {.size_m = {0.010, 0.008, 0.004}}),
                      .X_WO = {}};
  judge(rows, "closed path: ridges over ridges",
        go_round(
            pair,
            [](double phase) {
              const double angle = kTurn * phase;
              return Pose{spatial::rotation_from_vector(
                              {0.01 * std::sin(angle), 0.01 * std::cos(2 * angle), 0.2 * std::sin(angle)}) *
                              kTurnedOver,
                          {4e-3 * std::cos(angle), 4e-3 * std::sin(angle), -0.2e-3}};
            },
            400));
}

void box_over_an_edge(HardCaseRows& rows) {
  const Touching pair{.s = support::untextured(support::box_mesh({0.020, 0.020, 0.010})),
                      .t = support::untextured(support::box_mesh({0.010, 0.010, 0.010})),
                      .tolerance_m = 2e-3,
                      .X_WO = {}};
  judge(rows, "closed path: a box over the table's edge",
        go_round(
            pair,
            [](double phase) {
              const double angle = kTurn * phase;
              return Pose{spatial::rotation_from_vector({0.05 * std::sin(angle), 0.1 * std::cos(angle), 0}),
                          {0.011 + 0.003 * std::cos(angle), 0.002 * std::sin(angle), 0.0097}};
            },
            1000));
}

}  // namespace

std::span<const HardCase> closed_path_cases() {
  static constexpr HardCase kCases[] = {
      {"forth and back on a thread", screwed_on_and_off},
      {"closed path, peg", peg_round_its_hole},
      {"closed path, ridges", ridges_over_ridges},
      {"closed path, box", box_over_an_edge},
  };
  return kCases;
}

}  // namespace farfeel::bench
