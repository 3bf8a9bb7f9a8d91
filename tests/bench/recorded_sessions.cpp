#include "tests/bench/recorded_sessions.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "slave_sim/models/height_plate.h"
#include "tests/bench/benchmark_scenes.h"
#include "tests/bench/real_cases.h"
#include "tests/support/solids.h"
#include "tests/support/textured_solids.h"

namespace farfeel::bench {
namespace {

using local_model::Rung;
using spatial::Pose;
using transport::LinkSpec;

constexpr LinkSpec kNear{.round_trip_ns = 2'000'000}, kFar{.round_trip_ns = 50'000'000, .jitter_ns = 2'000'000};
constexpr LinkSpec kBad{.round_trip_ns = 100'000'000,
                        .jitter_ns = 10'000'000,
                        .loss = 0.02,
                        .burst = 5,
                        .reorder = 0.02,
                        .duplicate = 0.01};
/// It is silent for 300 ms and more at a time: contacts are held, and fade.
constexpr LinkSpec kGaps{.round_trip_ns = 20'000'000, .loss = 0.4, .burst = 300};

double wave(double s, double cycles) {
  return std::sin(2 * std::numbers::pi * cycles * s);
}

Pose turned(const glm::dvec3& degrees) {
  return {spatial::rotation_from_vector(std::numbers::pi / 180 * degrees), {}};
}

const slave_sim::PlateSize kTable{.size_m = {0.024, 0.020, 0.004}}, kTool{.size_m = {0.008, 0.006, 0.004}};

geometry::HapticSurface ridges(const slave_sim::PlateSize& size) {
  return slave_sim::ridged_plate(2e-3, 0.3e-3, size);
}
geometry::HapticSurface flat(const slave_sim::PlateSize& size) {
  return slave_sim::height_plate([](double, double) { return 0.0; }, size);
}
/// Rough at 1 to 4 mm, 30 um rms.
geometry::HapticSurface rough(const slave_sim::PlateSize& size) {
  return slave_sim::height_plate(
      [](double x, double y) {
        return 30e-6 * (std::sin(1600 * x + 900 * y) + std::sin(2900 * y - 1100 * x + 1) + std::sin(4100 * x + 2));
      },
      size);
}

/// The tool turned over, rubbed over the table to and fro and turned a little, deeper and deeper.
SessionToRecord rubbed(std::string name, geometry::HapticSurface table, geometry::HapticSurface tool) {
  SessionToRecord session;
  session.name = std::move(name);
  session.bodies.push_back({.surface = std::move(tool)});
  session.bodies.push_back({.surface = std::move(table)});
  session.X_start = {{0, 1, 0, 0}, {0, 0, 1e-3}};
  session.X_wanted = [](double s) {
    const Pose rubs = turned({0.6 * wave(s, 1), 0, 3 * wave(s, 1)});
    return Pose{glm::normalize(rubs.R * glm::dquat{0, 1, 0, 0}),
                {4e-3 * wave(s, 2), 1e-3 * wave(s, 3), 1e-3 - 1.6e-3 * std::min(1.0, 4 * s)}};
  };
  session.lean_N = 2;
  return session;
}

/// A case of `farfeel-bench hardcases loop`.
SessionToRecord of_case(std::string name, const std::string& title) {
  for (RealCase& real : real_cases()) {
    if (real.name() != title) continue;
    SessionToRecord session;
    session.name = std::move(name);
    session.bodies.push_back({.surface = real.pair->surface(0)});
    session.bodies.push_back({.surface = real.pair->surface(1)});
    session.tolerance_m = real.pair->options().tolerance_m;
    session.X_start = real.X_start;
    session.X_wanted = std::move(real.X_wanted);
    session.lean_N = 3, session.push_W = real.push_W;
    return session;
  }
  throw std::invalid_argument("no case is called " + title);
}

/// Strokes over a benchmark scene's object.
SessionToRecord of_scene(std::string name, std::string_view title, double length_s) {
  BenchmarkScene scene = benchmark_scene(title);
  scene.wanted.reset();  // any motion will do
  SessionToRecord session;
  session.name = std::move(name);
  session.length_s = length_s;
  session.tolerance_m = scene.tolerance_m;
  const auto motion = std::make_shared<std::vector<Pose>>(scene.motion(1, static_cast<std::size_t>(1e3 * length_s)));
  session.X_start = motion->front();
  session.X_wanted = [motion](double s) {
    return (*motion)[std::min(static_cast<std::size_t>(s * static_cast<double>(motion->size())), motion->size() - 1)];
  };
  session.body.mass_kg = scene.tool.mass_kg;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      session.body.inertia_To_T(row, column) = scene.tool.inertia_O_kg_m2[column][row];
  }
  session.bodies.push_back({.surface = std::move(scene.tool.felt), .material = scene.tool.material});
  session.bodies.push_back({.surface = std::move(scene.object.felt), .material = scene.object.material});
  return session;
}

/// From where it is to another pose and back.
motion::ScriptedMotion to_and_fro(const Pose& to) {
  const std::vector<motion::Keyframe> keys{{0, {}}, {0.3, {}}, {0.7, to}, {1.1, {}}};
  return {keys, motion::Afterwards::kStays};
}

/// A textured ball-like tool goes along a floor, into a corner and up a wall of another material; a block slides by.
SessionToRecord several_objects() {
  SessionToRecord session;
  session.name = "several-objects-tiles";
  const auto relief = [](const glm::dvec3& p) { return 20e-6 * (std::sin(3000 * p.x) + std::sin(2500 * (p.y + p.z))); };
  const contact::Material hard{.stiffness_N_per_m = 6000}, smooth{.static_friction = 0.05, .dynamic_friction = 0.04};
  session.bodies.push_back({.surface = support::textured(support::cylinder_mesh(3e-3, 6e-3, 12), relief, 0.1e-3)});
  session.bodies.push_back({.surface = rough(kTable), .material = smooth});
  session.bodies.push_back({.surface = support::untextured(support::box_mesh({0.004, 0.02, 0.02})),
                            .material = hard,
                            .X_WO = {{1, 0, 0, 0}, {0.011, 0, 0.008}}});
  session.bodies.push_back({.surface = support::untextured(support::box_mesh({0.006, 0.006, 0.006})),
                            .X_WO = {{1, 0, 0, 0}, {0, 0.009, 0.003}},
                            .motion = to_and_fro({{1, 0, 0, 0}, {0, -0.003, 0}})});
  session.X_start = {turned({0, 90, 0}).R, {-0.004, 0, 4e-3}};
  session.X_wanted = [](double s) {
    const double along = std::min(1.0, 1.6 * s);
    return Pose{glm::normalize(turned({8 * wave(s, 1), 0, 12 * wave(s, 2)}).R * turned({0, 90, 0}).R),
                {-0.004 + 0.0105 * along, 1.5e-3 * wave(s, 2), 2.6e-3 + 2e-3 * std::max(0.0, s - 0.7)}};
  };
  session.link = {.round_trip_ns = 20'000'000, .jitter_ns = 1'000'000};
  return session;
}

SessionToRecord with(SessionToRecord session, Rung rung, const LinkSpec& link) {
  session.rung = rung, session.link = link;
  return session;
}

}  // namespace

std::vector<SessionToRecord> sessions_to_record() {
  std::vector<SessionToRecord> all;
  const auto add = [&all](SessionToRecord session, Rung rung, const LinkSpec& link) -> SessionToRecord& {
    return all.emplace_back(with(std::move(session), rung, link));
  };
  // Every rung, on near, far and bad links.
  add(rubbed("ridges-in-ridges-tiles", ridges(kTable), ridges(kTool)), Rung::kTiles, {});
  add(rubbed("ridges-in-ridges-tiles-bad", ridges(kTable), ridges(kTool)), Rung::kTiles, kBad).body.mass_kg = 0.001;
  add(rubbed("ridges-in-ridges-linear-bad", ridges(kTable), ridges(kTool)), Rung::kLinear, kBad);
  add(rubbed("rough-on-rough-quadratic", rough(kTable), rough(kTool)), Rung::kQuadratic, kFar);
  add(rubbed("ridges-held-wrench", ridges(kTable), flat(kTool)), Rung::kHeldWrench, kNear);
  add(rubbed("ridges-linear-told-alone", ridges(kTable), rough(kTool)), Rung::kLinear, kFar).has_outline = false;
  add(rubbed("flat-direct-force", flat(kTable), flat(kTool)), Rung::kLinear, kNear).controller =
      teleoperation::Controller::kDirect;
  // Shapes.
  add(of_case("peg-in-hole-quadratic", "peg in hole, clearance 0.10 mm"), Rung::kQuadratic, kNear);
  add(of_case("gear-interlock-tiles", "gear interlock"), Rung::kTiles, kFar).integrator = tool::Integrator::kMidpoint;
  add(of_case("nut-on-bolt-tiles", "nut on bolt"), Rung::kTiles, kNear);
  add(of_case("needle-on-ridges-5-khz", "needle on ridges of 2 mm"), Rung::kTiles, kNear).body.mass_kg = 0.001;
  all.back().tick_ns = 200'000, all.back().length_s = 0.4;
  all.push_back(several_objects());
  add(of_scene("gear-on-block-tiles", "block-gear", 0.8), Rung::kTiles, kFar);
  add(of_scene("file-on-cad-linear", "file-cad", 0.6), Rung::kLinear, kFar);
  add(of_scene("hammer-on-torus-quadratic", "hammer-torus", 0.4), Rung::kQuadratic, kNear).grip =
      master_station::kHardGrip;
  // What happens meanwhile.
  add(rubbed("turning-ridges-tiles", ridges(kTable), ridges(kTool)), Rung::kTiles, kFar).bodies[1].motion =
      to_and_fro(turned({0, 0, 30}));
  add(rubbed("rising-plate-linear-gaps", flat(kTable), rough(kTool)), Rung::kLinear, kGaps).bodies[1].motion =
      to_and_fro({{1, 0, 0, 0}, {0, 0, 0.001}});
  add(rubbed("edits-tiles-unplugged", ridges(kTable), rough(kTool)), Rung::kTiles, kNear).edits_from_s = 0.4;
  all.back().unplugged_at_s = 0.7;
  add(rubbed("late-ticks-rest-and-stall", ridges(kTable), ridges(kTool)), Rung::kTiles, kNear).late_share = 0.4;
  all.back().stalls_at_s = 0.6;
  add(rubbed("ridges-historical", ridges(kTable), flat(kTool)), Rung::kLinear, kNear).is_historical = true;
  all.back().length_s = 0.3;
  return all;
}

}  // namespace farfeel::bench
