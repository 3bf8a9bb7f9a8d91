// Plates and ridges: what is felt is a height field along the contact's direction.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "haptic_core/penetration/reference/reference.h"
#include "haptic_core/penetration/simd/simd.h"
#include "slave_sim/models/height_plate.h"
#include "tests/bench/hardcases_contact.h"

namespace farfeel::bench {
namespace {

using slave_sim::height_plate;
using slave_sim::ridged_plate;
using spatial::Pose;

constexpr double kPress_m = 0.2e-3;
constexpr double kUnresolved_um = 12, kUnresolvedPercent = 5;  ///< of an answer that says it is unresolved
const slave_sim::PlateSize kToolSize{.size_m = {0.010, 0.008, 0.004}, .texel_m = 0.5e-4};
const slave_sim::PlateSize kTableSize{.size_m = {0.024, 0.020, 0.004}, .texel_m = 0.5e-4};

geometry::HapticSurface flat(const slave_sim::PlateSize& size) {
  return height_plate([](double, double) { return 0.0; }, size);
}

Pose pressed(double x_m = 0, double depth_m = kPress_m) {
  return {kTurnedOver, {x_m, 0, -depth_m}};
}

void ridge_period_against_the_grid(HardCaseRows& rows) {
  const double step_m = kToolSize.size_m.x / 50;
  for (const double ratio : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    const double period_m = ratio * step_m;
    slave_sim::PlateSize fine = kTableSize;
    fine.texel_m = std::min(period_m / 8, 0.5e-4);
    const Touching pair{.s = ridged_plate(period_m, 0.15 * period_m, fine), .t = flat(kToolSize), .X_WO = {}};
    const std::string name = fmt::format("ridge period / grid step = {}", ratio);
    // A flat tool on ridges rests on crests: the hard depth is the press, whatever the grid; the soft one carries the
    // crests' area, w ln(area / a0), which the converged integral knows.
    const contact::ContactSet fast = pair.answer(pressed(0.03e-3)),
                              truth = pair.answer(pressed(0.03e-3), kTruthMaker, 200);
    // Ridges as fine as the grid touch in more places than can be summed: then the answer says so, and errs more.
    const bool says_so = ratio <= 1 && (deepest_of(fast).doubts & penetration::kCoarseSteps) != 0;
    rows.push_back({name, "depth against truth, or marked as unresolved",
                    1e6 * std::abs(deepest_of(fast).depth_m - deepest_of(truth).depth_m), "um",
                    says_so ? kUnresolved_um : 2.5});
    rows.push_back({name, "wrench against truth, or marked as unresolved",
                    100 * wrench_error(fast.F_To_W, truth.F_To_W), "%", says_so ? kUnresolvedPercent : 2});
  }
}

// Ridges of one period on both sides: the hard depth is press + 2 a cos(pi x / period) - 2 a.
void interlocking_ridges(HardCaseRows& rows) {
  for (const double period_m : {1e-3, 2e-3, 4e-3}) {
    const double a_m = 0.05 * period_m;  // each ridge is 2 a high
    slave_sim::PlateSize tool = kToolSize;
    tool.size_m.x = 4 * period_m + 2e-3;
    const Touching pair{
        .s = ridged_plate(period_m, 2 * a_m, kTableSize), .t = ridged_plate(period_m, 2 * a_m, tool), .X_WO = {}};
    for (const double speed_m_s : {0.01, 0.1, 0.3}) {
      contact_service::ContactService fast = pair.service();
      double depth_m = 0, force = 0, least_m = 1e9, most_m = -1e9;
      const double stiffness = contact::combined({}, {}).stiffness_N_per_m;
      for (std::uint32_t i = 0; i < 40; ++i) {
        const double x_m = -0.25 * period_m + std::fmod(speed_m_s * 1e-3 * i, 0.5 * period_m);
        const contact::ContactSet& set = fast.answer(pose_number(i, pressed(x_m, 0.5e-3)));
        const contact::Contact contact = deepest_of(set);
        const double k = std::numbers::pi / period_m, slope = -2 * a_m * k * std::sin(k * x_m);
        const double off_m = contact.depth_m - (0.5e-3 + 2 * a_m * (std::cos(k * x_m) - 1));
        least_m = std::min(least_m, off_m),
        most_m = std::max(most_m, off_m);  // w ln(area / a0) is nearly the same all along
        force = std::max(force, std::abs(set.F_To_W.force_N.x + stiffness * contact.depth_m * slope) /
                                    (stiffness * contact.depth_m));
      }
      depth_m = most_m - least_m;
      const std::string name =
          fmt::format("ridges of {:.0f} mm on ridges, {:.0f} mm/s", 1e3 * period_m, 1e3 * speed_m_s);
      rows.push_back({name, "depth: spread about the closed form", 1e6 * depth_m, "um", 5});
      rows.push_back({name, "sideways force against the closed form", 100 * force, "%", 3});
    }
  }
}

/// Two saws, slid 1 um a millisecond over a pitch, by a service that widens contacts that the loop could not hold: how
/// the width changes the force, and how much the force changes in a step.
void saw_in_saw(HardCaseRows& rows) {
  constexpr double kPitch_m = 0.5e-3, kHigh_m = 0.1e-3, kDeep_m = 0.5e-3;
  const auto saw = [](double x, double) {
    return -2 * kHigh_m * std::abs(x / kPitch_m - std::floor(x / kPitch_m) - 0.5);
  };
  const geometry::HapticSurface table = height_plate(saw, {.size_m = {0.016, 0.012, 0.004}, .texel_m = 0.4e-4}),
                                tool = height_plate(saw, {.size_m = {8e-3, 6e-3, 0.004}, .texel_m = 0.4e-4});
  for (const double N_per_m : {2000.0, 4000.0}) {
    contact_service::TouchableObject s{.felt = &table, .material = {}}, t{.felt = &tool, .material = {}};
    s.material = t.material = {
        .stiffness_N_per_m = 2 * N_per_m, .damping_Ns_per_m = 0, .static_friction = 0, .dynamic_friction = 0};
    contact_service::ContactService narrow({&s, 1}, t, {}),
        held({&s, 1}, t, {.most_stiffness_N_per_m = contact_service::kHeldStiffness_N_per_m});
    constexpr std::uint32_t kSettling = 50, kTicks = 550;
    double off = 0, step_N = 0;
    glm::dvec3 last_N{0};
    for (std::uint32_t i = 0; i < kTicks; ++i) {
      const contact_service::ToolPose at = pose_number(i, pressed(i < kSettling ? 0 : 1e-6 * (i - kSettling), kDeep_m));
      const glm::dvec3 of_held_N = held.answer(at).F_To_W.force_N, of_narrow_N = narrow.answer(at).F_To_W.force_N;
      if (i >= kSettling) {
        off = std::max(off, std::abs(of_held_N.z / of_narrow_N.z - 1));
        step_N = std::max(step_N, glm::distance(of_held_N, last_N));
      }
      last_N = of_held_N;
    }
    const std::string name = fmt::format("saw in saw, {:.0f} N/mm", 1e-3 * N_per_m);
    rows.push_back({name, "normal force of the held width against the narrow one", 100 * off, "%", 5});
    rows.push_back({name, "greatest change of force in 1 um", step_N, "N", 0.1});
  }
}

void flat_on_flat(HardCaseRows& rows) {
  const Touching pair{.s = flat(kTableSize), .t = flat(kToolSize), .X_WO = {}};
  for (const double tilt : {1e-9, 1e-7, 1e-5, 1e-4, 1e-3}) {
    double arm_m = 0;
    for (int way = 0; way < 8; ++way) {
      const double angle = way * std::numbers::pi / 4;
      Pose pose = pressed();
      pose.R = spatial::rotation_from_vector({tilt * std::cos(angle), tilt * std::sin(angle), 0}) * pose.R;
      const spatial::Wrench F = pair.answer(pose).F_To_W;
      arm_m = std::max(arm_m, glm::length(F.torque_Nm) / glm::length(F.force_N));
    }
    // Tilted by t, one side of the tool (half 5 mm) sinks 10 mm t deeper: with w = 10 um that is felt from 1e-4 on.
    const double bound_mm = tilt <= 1e-5 ? 0.1 : 7;
    rows.push_back({fmt::format("flat on flat, tilted {:.0e} rad", tilt), "torque's arm", 1e3 * arm_m, "mm", bound_mm});
  }
}

void grid_not_divisible_by_the_lanes(HardCaseRows& rows) {
  const Touching pair{
      .s = ridged_plate(3e-3, 0.5e-3, kTableSize), .t = ridged_plate(2e-3, 0.3e-3, kToolSize), .X_WO = {}};
  const contact::ContactSet truth = pair.answer(pressed(0.2e-3), kTruthMaker, 200);
  double depth_m = 0;
  for (const std::uint32_t samples : {33u, 37u, 41u, 46u, 49u, 51u, 53u, 63u}) {
    const contact::ContactSet fast = pair.answer(pressed(0.2e-3), {}, samples);
    depth_m = std::max(depth_m, std::abs(deepest_of(fast).depth_m - deepest_of(truth).depth_m));
  }
  rows.push_back({"N not divisible by the lanes, 33 to 63", "depth against truth, largest", 1e6 * depth_m, "um", 2.5});
}

void far_from_the_origin(HardCaseRows& rows) {
  Touching pair{.s = ridged_plate(3e-3, 0.5e-3, kTableSize), .t = ridged_plate(2e-3, 0.3e-3, kToolSize), .X_WO = {}};
  const contact::Contact here = deepest_of(pair.answer(pressed(0.2e-3)));
  for (const double far_m : {1e3, 1e4}) {
    pair.X_WO.p = {far_m, -0.7 * far_m, 0.3 * far_m};
    const contact::Contact there = deepest_of(pair.answer(pressed(0.2e-3)));
    const std::string name = fmt::format("{:.0f} km from the origin", 1e-3 * far_m);
    rows.push_back({name, "depth against at the origin", 1e9 * std::abs(there.depth_m - here.depth_m), "nm", 0.1});
    rows.push_back({name, "gradient", (there.gradient - here.gradient).norm(), "1", 1e-6});
  }
}

// Two crests of equal height under a flat tool's crest that slides across the valley between them.
void two_equal_peaks(HardCaseRows& rows) {
  const auto peaks = [](double x_m, double y_m) {
    const double left = x_m + 0.5e-3, right = x_m - 0.5e-3;
    return -std::min(left * left, right * right) / (2 * 0.5e-3) - y_m * y_m / (2 * 5e-3);
  };
  const Touching pair{.s = height_plate(peaks, {.size_m = {0.006, 0.006, 0.004}, .texel_m = 2e-5}),
                      .t = height_plate([](double x_m, double y_m) { return -(x_m * x_m + y_m * y_m) / (2 * 2e-3); },
                                        {.size_m = {0.004, 0.004, 0.004}, .texel_m = 2e-5}),
                      .X_WO = {}};
  const double widths_m[] = {5e-6, 10e-6, 20e-6}, bounds[] = {0.5, 0.25, 0.13};
  for (std::size_t k = 0; k < 3; ++k) {
    contact_service::ContactService service = pair.service({}, 50, widths_m[k]);
    spatial::Vector6 last = spatial::Vector6::Zero();
    double jump = 0;
    for (std::uint32_t i = 0; i < 60; ++i) {  // 50 mm/s at 1 kHz, across the middle
      const contact::Contact contact = deepest_of(service.answer(pose_number(i, pressed((i - 30.0) * 5e-5 + 1.7e-5))));
      if (i > 0) jump = std::max(jump, (contact.gradient - last).tail<3>().norm());
      last = contact.gradient;
    }
    rows.push_back({fmt::format("two equal peaks, 50 mm/s, w = {:.0f} um", 1e6 * widths_m[k]),
                    "gradient's jump at 1 kHz", jump, "1", bounds[k]});
  }
}

// A mass on a spring is pulled over the valley between two peaks and rests there; explicit steps at 1 kHz. What a hard
// maximum makes chatter.
void toy_aliveness(HardCaseRows& rows) {
  const Touching pair{.s = ridged_plate(1e-3, 0.3e-3, {.size_m = {0.006, 0.006, 0.004}, .texel_m = 2e-5}),
                      .t = ridged_plate(1e-3, 0.3e-3, {.size_m = {0.004, 0.004, 0.004}, .texel_m = 2e-5}),
                      .X_WO = {}};
  constexpr double kMass_kg = 0.1, kSpring_N_per_m = 500, kDamping_Ns_per_m = 4, kDt_s = 1e-3;
  contact_service::ContactService service = pair.service();
  const glm::dvec3 hand{0.5e-3, 0, -1.2e-3};  // half a period: crest on valley
  Pose pose = pressed(0.45e-3, 0.1e-3);
  glm::dvec3 v{0};
  double least_N = 1e9, most_N = -1e9;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const contact::ContactSet& set = service.answer(pose_number(i, pose));
    const glm::dvec3 force = set.F_To_W.force_N + kSpring_N_per_m * (hand - pose.p) - kDamping_Ns_per_m * v;
    v += kDt_s / kMass_kg * force;
    v.y = 0;
    pose.p += kDt_s * v;
    if (i >= 800) least_N = std::min(least_N, set.F_To_W.force_N.x), most_N = std::max(most_N, set.F_To_W.force_N.x);
  }
  rows.push_back(
      {"toy: a mass pressed into a valley", "sideways force, peak to peak at rest", 1e3 * (most_N - least_N), "mN", 5});
}

void second_layer(HardCaseRows& rows) {
  // A slab 12 mm thick, its floor felt, its underside a second layer; and a shelf above the tool.
  const Touching slab{
      .s = height_plate([](double, double) { return 0.0; }, {.size_m = {0.024, 0.020, 0.012}, .texel_m = 1e-4}),
      .t = ridged_plate(2e-3, 0.3e-3, kToolSize),
      .X_WO = {}};
  const double thick = deepest_of(slab.answer(pressed())).depth_m;
  const Touching thin{.s = flat(kTableSize), .t = ridged_plate(2e-3, 0.3e-3, kToolSize), .X_WO = {}};
  rows.push_back({"a second layer 8 mm deeper", "depth against without it",
                  1e6 * std::abs(thick - deepest_of(thin.answer(pressed())).depth_m), "um", 0.1});
}

// The back end asked along a direction that is not the surface's: what cannot be known must be flagged.
void tilted_direction(HardCaseRows& rows) {
  const geometry::HapticSurface s_surface = ridged_plate(2e-3, 0.3e-3, kTableSize),
                                t_surface = ridged_plate(3e-3, 0.3e-3, kToolSize);
  const penetration::FeltSurface s(s_surface), t(t_surface);
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < s_surface.coarse.triangles.size(); ++i) all.push_back(i);
  const auto simd = penetration::make_simd({}), truth = penetration::make_reference({}, penetration::kTruth);
  for (const double degrees : {30.0, 50.0, 60.0, 75.0, 85.0}) {
    const Pose X_CS{spatial::rotation_from_vector({0, degrees * std::numbers::pi / 180, 0}), {}};
    penetration::Query query{
        .s = {&s, X_CS, all}, .t = {&t, X_CS * pressed(), all}, .window = {{-2e-3, -2e-3}, {2e-3, 2e-3}}};
    penetration::Penetration fast, slow;
    simd->evaluate({&query, 1}, {&fast, 1});
    query.samples = 200;
    truth->evaluate({&query, 1}, {&slow, 1});
    const bool is_flagged = (fast.doubts & (penetration::kNoOverlap | penetration::kGrazing)) != 0;
    const double off_um = 1e6 * std::abs(fast.depth_m - slow.depth_m);
    rows.push_back({fmt::format("direction tilted by {:.0f} degrees", degrees),
                    is_flagged ? "depth against truth (flagged: 0)" : "depth against truth", is_flagged ? 0 : off_um,
                    "um", 16});
  }
}

}  // namespace

std::span<const HardCase> height_field_cases() {
  static constexpr HardCase kCases[] = {
      {"tilted direction", tilted_direction},
      {"second layer", second_layer},
      {"ridge period against the grid", ridge_period_against_the_grid},
      {"ridges on ridges", interlocking_ridges},
      {"saw in saw", saw_in_saw},
      {"flat on flat, tilted", flat_on_flat},
      {"far from the origin", far_from_the_origin},
      {"two equal peaks", two_equal_peaks},
      {"mass in a valley", toy_aliveness},
      {"lanes", grid_not_divisible_by_the_lanes},
  };
  return kCases;
}

}  // namespace farfeel::bench
