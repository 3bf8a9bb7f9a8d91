// Objects that move by a script under a tool that a hand holds against them: they turn, slide, rise and come to rest.
// Both ends of the link look the script up. The hand stays where it is all the time.
#include <cmath>
#include <memory>
#include <numbers>

#include "slave_sim/bake/asset_cache.h"
#include "slave_sim/models/height_plate.h"
#include "tests/bench/hardcases_jobs.h"
#include "tests/bench/remote_across_link.h"

namespace farfeel::bench {
namespace {

using namespace master_station;
using spatial::Pose;

constexpr double kBegin_s = 1, kEnd_s = 3.5, kJudged_s = 0.5;  // after the tool is lowered; at rest from 2.75 s on

struct MovingCase {
  std::unique_ptr<FeltPair> pair;
  Pose X_held;            ///< of the tool in W, just touching
  bool does_hop = false;  ///< from groove to groove, which is a step of force by itself
  contact::Material material{};
  tool::MassProperties body{0.05, Eigen::Vector3d(4e-6, 4e-6, 4e-6).asDiagonal()};

  [[nodiscard]] const std::string& name() const { return pair->name(); }
};

/// From `from` to `to` and back; at rest from then on.
motion::ScriptedMotion to_and_fro(const Pose& from, const Pose& to) {
  const std::vector<motion::Keyframe> keys{
      {kBegin_s - 0.5, from},  {kBegin_s, from},        {kBegin_s + 0.75, to},
      {kBegin_s + 1.75, from}, {kBegin_s + 1.76, from},  // the parabola through so short a gap stops it there
      {kEnd_s, from}};
  return {keys, motion::Afterwards::kStays};
}

Pose turned(const glm::dvec3& degrees) {
  return {spatial::rotation_from_vector(std::numbers::pi / 180 * degrees), {}};
}

MovingCase gear_under_block() {
  const codecs::Asset gear = slave_sim::cached_model_asset("gear").value(),
                      block = slave_sim::cached_model_asset("block").value();
  MovingCase c;
  c.pair = std::make_unique<FeltPair>("a gear turns under a ridged block", gear.felt, block.felt, 2e-3);
  const Pose upright = turned({90, 0, 0});
  c.pair->move_by(to_and_fro(upright, turned({0, 12, 0}) * upright));
  c.X_held.p = {0.002, 0, 0.060 + 0.020};
  c.does_hop = true;
  c.material = block.material;
  c.body.mass_kg = block.mass_kg;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) c.body.inertia_To_T(row, column) = block.inertia_O_kg_m2[column][row];
  }
  return c;
}

MovingCase plates(const std::string& name, geometry::HapticSurface table, geometry::HapticSurface tool,
                  const Pose& to) {
  MovingCase c;
  c.pair = std::make_unique<FeltPair>(name, std::move(table), std::move(tool), 2e-3);
  c.pair->move_by(to_and_fro({}, to));
  c.X_held = {{0, 1, 0, 0}, {0.008, 0.004, 0}};
  return c;
}

std::vector<MovingCase> moving_cases() {
  const slave_sim::PlateSize table{.size_m = {0.048, 0.040, 0.004}}, tool{.size_m = {0.008, 0.006, 0.004}};
  const auto flat = [](const slave_sim::PlateSize& size) {
    return slave_sim::height_plate([](double, double) { return 0.0; }, size);
  };
  const auto ridges = [](const slave_sim::PlateSize& size) { return slave_sim::ridged_plate(2e-3, 0.2e-3, size); };
  const auto tip = [&] {
    return slave_sim::height_plate([](double x, double y) { return -(x * x + y * y) / (2 * 6e-3); }, tool);
  };
  std::vector<MovingCase> all;
  all.push_back(gear_under_block());
  all.push_back(
      plates("a flat plate slides under a flat tool", flat(table), flat(tool), {{1, 0, 0, 0}, {0.01, 0.004, 0}}));
  all.push_back(plates("a flat plate turns under a flat tool", flat(table), flat(tool), turned({0, 0, 40})));
  all.push_back(plates("a flat plate rises and sinks", flat(table), flat(tool), {{1, 0, 0, 0}, {0, 0, 0.004}}));
  all.push_back(plates("a flat plate rocks under a flat tool", flat(table), flat(tool), turned({4, 6, 0})));
  all.push_back(plates("ridges turn under a round tip", ridges(table), tip(), turned({0, 0, 40})));
  all.push_back(plates("ridges turn under ridges", ridges(table), ridges(tool), turned({0, 0, 40})));
  all.back().does_hop = true;
  return all;
}

LoopCaseRow run(const MovingCase& tried, const LoopJob& job) {
  SimulatedDevice device(device_of(job));
  const contact::Material material = material_of(job, tried.material);
  RemoteAcrossLink remote(*tried.pair, material, job.link, RemoteAcrossLink::options_of(job.rung));
  HapticLoopSettings settings = loop_of(job, tried.body);
  settings.moving = {{0, *tried.pair->script()}};
  const Pose X_above{tried.X_held.R, tried.X_held.p + glm::dvec3(0, 0, 1e-3)};
  settings.X_WB = X_above * spatial::inverse(device.true_pose());
  HapticLoop loop(device, remote, settings, remote.contacts());
  const double stiffness = 32 * contact::combined(material, material).stiffness_N_per_m;
  LoopWatch watch(job.tick_ns);
  const double lean_m = kPush_N / job.grip.stiffness_N_per_m;
  const auto ticks = [&job](double s) { return static_cast<int>(std::lround(s * job.tick_hz())); };
  for (int i = 0; i < ticks(kEnd_s); ++i) {
    const double down =
        std::clamp(1e-9 * static_cast<double>(i * job.tick_ns) / 0.4 - 1, 0.0, 1.0);  // from 0.4 to 0.8 s
    Pose X_WHand = X_above;
    X_WHand.p.z -= down * (1e-3 + lean_m);
    device.hold_at(spatial::inverse(settings.X_WB) * X_WHand);
    remote.at(i * job.tick_ns);
    loop.tick({i * job.tick_ns, 0, 0, 0});
    watch.look(loop, stiffness, i >= ticks(kBegin_s), i >= ticks(kEnd_s - kJudged_s));
  }
  LoopCaseRow row = row_of(tried.name(), job, watch.figures(loop, device));
  const LoopFigures& f = row.figures;
  row.passes = is_sound(f, loop) && f.ripple_share <= kMaxRipple && f.largest_N <= kMostPushes * kPush_N &&
               (tried.does_hop || f.step_N <= std::max(kMaxStep_N, kMaxStepShare * f.force_N));
  return row;
}

}  // namespace

std::vector<LoopCaseRow> judge_moving_objects(const LoopCaseChoice& choice) {
  std::vector<LoopJob> jobs;
  for (const local_model::Rung rung : {local_model::Rung::kLinear, local_model::Rung::kTiles})
    for (const Grip& grip : {kSoftGrip, kHardGrip})
      for (const transport::LinkSpec& link : links_of(choice, {50, 200}))
        for (const double mass_kg : {0.001, 0.1})
          jobs.push_back({rung, grip, link, mass_kg, choice.tick_ns(), choice.stiffness_N_per_m});
  return run_jobs(moving_cases(), jobs, choice, run);
}

}  // namespace farfeel::bench
