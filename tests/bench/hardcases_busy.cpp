// Benchmark scenes that a simulated person explores, on a machine that has other things to do: where a tick takes too
// long, the next does not look at the tiles, and tiles rest for seconds; ticks are late or lost. What is felt changes
// hands all the time, between the tiles, a linearisation of them and what the remote tells. What is drawn is the same
// in every run.
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "slave_sim/world/world.h"
#include "tests/bench/hardcases_jobs.h"
#include "tests/bench/remote_across_link.h"

namespace farfeel::bench {
namespace {

using namespace master_station;

constexpr double kLength_s = 10, kJudged_s = 2;
constexpr double kCalmWork = 0.3;                                    // of a period, mostly
constexpr double kBusyShare = 0.06, kBusyWork = 0.6, kMostWork = 4;  // of the ticks; of a period
constexpr double kMostLate = 0.05;                                   // of a period
/// The rest is for ways between strokes: block on block touches for 0.93 of the time where nothing is late.
constexpr double kLeastTouching = 0.8;

struct BusyCase {
  std::unique_ptr<FeltPair> pair;
  codecs::SceneDescription told;
  contact::Material material;

  [[nodiscard]] const std::string& name() const { return pair->name(); }
};

std::string name_of(const std::string& scene) {
  return scene + " explored, ticks spared";
}

BusyCase explored(const std::string& scene) {
  slave_sim::World world = slave_sim::load_world(slave_sim::find_scene(scene).value()).value();
  slave_sim::WorldObject& object = world.objects.front();
  BusyCase c{.pair = nullptr, .told = slave_sim::description_of(world), .material = world.tool.material};
  c.pair = std::make_unique<FeltPair>(name_of(scene), std::move(object.asset.felt), std::move(world.tool.felt),
                                      world.definition.tolerance_m, object.X_WO);
  return c;
}

std::vector<BusyCase> busy_cases(const std::string& only) {
  std::vector<BusyCase> all;
  for (const char* scene : {"block-gear", "file-cad", "block-block"})
    if (name_of(scene).find(only) != std::string::npos) all.push_back(explored(scene));
  return all;
}

HapticLoopSettings loop_of(const BusyCase& tried, const LoopJob& job) {
  const codecs::SceneTool& tool = tried.told.tool;
  tool::MassProperties body{.mass_kg = tool.mass_kg};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) body.inertia_To_T(row, column) = tool.inertia_To_T_kg_m2[column][row];
  HapticLoopSettings settings = loop_of(job, body);
  settings.X_TG.p = tried.told.exploration.p_TWork_T;
  settings.tiles_may_rest = true;
  return settings;
}

LoopCaseRow run(const BusyCase& tried, const LoopJob& job) {
  SimulatedDeviceSettings device_settings;
  device_settings.grip = job.grip;
  device_settings.explorer.hints = tried.told.exploration;
  device_settings.explorer.X_TG.p = tried.told.exploration.p_TWork_T;
  SimulatedDevice device(device_settings);
  const contact::Material material = material_of(job, tried.material);
  RemoteAcrossLink remote(*tried.pair, material, job.link, RemoteAcrossLink::options_of(job.rung));
  HapticLoop loop(device, remote, loop_of(tried, job), remote.contacts());

  std::mt19937 lots(1);
  const auto even = [&lots] { return static_cast<double>(lots()) / static_cast<double>(std::mt19937::max()); };
  const auto tick_ns = static_cast<double>(job.tick_ns);
  const double stiffness_N_per_m = 32 * contact::combined(material, material).stiffness_N_per_m;
  const auto end = std::llround(kLength_s * job.tick_hz()), judged = std::llround(kJudged_s * job.tick_hz());
  LoopWatch watch(job.tick_ns);
  double work = kCalmWork;
  int ticks = 0, touching = 0;
  for (std::int64_t i = 0; i < end; ++ticks) {
    const double late = kMostLate * even();
    const std::int64_t late_ns = std::llround(late * tick_ns);
    remote.at(i * job.tick_ns + late_ns);
    loop.tick({i * job.tick_ns, late_ns, std::llround(work * tick_ns), 0});
    touching += watch.look(loop, stiffness_N_per_m, false, i >= end - judged).contacts > 0;
    work = even() < kBusyShare ? kBusyWork + even() * (kMostWork - kBusyWork) : kCalmWork;
    i += std::max<std::int64_t>(1, std::llround(std::ceil(late + work)));
  }
  LoopCaseRow row = row_of(tried.name(), job, watch.figures(loop, device));
  row.passes = is_sound(row.figures, loop) && touching >= kLeastTouching * ticks;
  return row;
}

}  // namespace

std::vector<LoopCaseRow> judge_busy_machines(const LoopCaseChoice& choice) {
  constexpr transport::LinkSpec kOneMachine{.round_trip_ns = 1'000'000};
  constexpr double kMass_kg = 0.1;  // as heavy as these tools are simulated
  std::vector<LoopJob> jobs;
  for (const local_model::Rung rung : {local_model::Rung::kLinear, local_model::Rung::kTiles})
    for (const Grip& grip : {kSoftGrip, kMediumGrip})
      jobs.push_back({rung, grip, kOneMachine, kMass_kg, choice.tick_ns(), choice.stiffness_N_per_m});
  return run_jobs(busy_cases(choice.only), jobs, choice, run);
}

}  // namespace farfeel::bench
