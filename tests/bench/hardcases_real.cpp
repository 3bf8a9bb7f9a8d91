// Real shapes in closed loop: the contact service at the far end of a link, the haptic loop, the simulated device and a
// hand that pushes the tool about and then holds it still. What the hand does is a path of the tool's own frame; the
// tool follows it as far as it is let.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>

#include "slave_sim/models/height_plate.h"
#include "tests/bench/hardcases_jobs.h"
#include "tests/bench/remote_across_link.h"
#include "tests/support/solids.h"

namespace farfeel::bench {
namespace {

using namespace master_station;
using namespace support;
using spatial::Pose;

constexpr int kFree = 200, kMoved = 1200, kStill = 1500, kJudged = 500;  // ms

struct RealCase {
  std::unique_ptr<FeltPair> pair;
  Pose X_start;  ///< of the tool in W, touching nothing or with play
  /// Where the hand wants the tool, from 0 (begins to move) over 1 (has come to rest) on, beyond the push: in W.
  std::function<Pose(double)> X_wanted;
  glm::dvec3 push_W;    ///< direction the hand leans in at the end, unit; 0: none
  double hooked_m = 0;  ///< how far the hand pulls on, across its push, at a tool that hooks behind something stiff

  [[nodiscard]] const std::string& name() const { return pair->name(); }
};

Pose moved_by(const Pose& X, const glm::dvec3& by) {
  return {X.R, X.p + by};
}

Pose turned_by(const Pose& X, const glm::dvec3& v_rad) {
  return {glm::normalize(spatial::rotation_from_vector(v_rad) * X.R), X.p};
}

double wave(double s, double cycles) {
  return s < 1 ? std::sin(2 * std::numbers::pi * cycles * s) : 0;
}

RealCase peg_in_hole(double clearance_m) {
  RealCase c;
  c.pair = std::make_unique<FeltPair>(fmt::format("peg in hole, clearance {:.2f} mm", 1e3 * clearance_m),
                                      untextured(tube_mesh(0.010, 0.016, 0.020, 48)),
                                      untextured(cylinder_mesh(0.010 - clearance_m, 0.030, 48)), 2e-3);
  c.X_wanted = [](double s) {
    return turned_by({{1, 0, 0, 0}, {0, 0, 0.002 * wave(s, 2)}}, {0.02 * wave(s, 3), 0.02 * wave(s, 1), 0});
  };
  c.push_W = {0.8, 0.6, 0};
  return c;
}

RealCase nut_on_bolt() {
  const Thread thread{.turns = 3, .sides = 16};
  RealCase c;
  c.pair = std::make_unique<FeltPair>("nut on bolt", untextured(bolt_mesh(thread)),
                                      untextured(nut_mesh(thread, 0.1e-3, 1)), 1e-3);
  c.X_wanted = [](double s) {  // pulled up and down, turned with the thread a little
    return turned_by({{1, 0, 0, 0}, {0, 0, 0.4e-3 * wave(s, 3)}}, {0, 0, 0.2 * wave(s, 1)});
  };
  c.push_W = {0, 0, 1};
  return c;
}

RealCase gear_interlock() {
  constexpr std::uint32_t kTeeth = 24;
  constexpr double kRadius_m = 0.020, kTooth_m = 3e-3, kPlay_m = 0.4e-3, kHalfTooth = std::numbers::pi / kTeeth;
  RealCase c;
  c.pair = std::make_unique<FeltPair>("gear interlock", untextured(spur_mesh(kTeeth, kRadius_m, kTooth_m, 0.010)),
                                      untextured(spur_mesh(kTeeth, kRadius_m, kTooth_m, 0.008)), 1e-3);
  c.X_start = {spatial::rotation_from_vector({0, 0, std::numbers::pi + kHalfTooth}),
               {2 * kRadius_m + kTooth_m + kPlay_m, 0, 0}};
  c.X_wanted = [start = c.X_start](double s) { return turned_by(start, {0, 0, 0.15 * wave(s, 2)}); };
  c.push_W = {-1, 0, 0};  // into the mesh
  return c;
}

RealCase opposed_walls() {
  geometry::TriangleMesh slot = box_mesh({0.010, 0.020, 0.020});
  const geometry::TriangleMesh one = slot;
  for (glm::dvec3& p : slot.positions_O) p.x -= 0.010;
  for (const glm::dvec3& p : one.positions_O) slot.positions_O.push_back(p + glm::dvec3(0.010, 0, 0));
  for (geometry::Triangle t : one.triangles) {
    for (std::uint32_t& v : t) v += static_cast<std::uint32_t>(one.positions_O.size());
    slot.triangles.push_back(t);
  }
  RealCase c;  // the plate is 0.2 mm too thick for its slot
  c.pair =
      std::make_unique<FeltPair>("opposed walls", untextured(slot), untextured(box_mesh({0.0102, 0.010, 0.010})), 2e-3);
  c.X_start.p.z = 0.018;  // above the slot
  c.X_wanted = [](double s) { return Pose{{1, 0, 0, 0}, {0.5e-3 * wave(s, 4), 0, 0.018 * std::max(0.0, 1 - 3 * s)}}; };
  c.push_W = {1, 0, 0};
  return c;
}

RealCase grazing_edge() {
  RealCase c;
  c.pair = std::make_unique<FeltPair>("grazing edge", untextured(box_mesh({0.020, 0.020, 0.010})),
                                      untextured(box_mesh({0.010, 0.010, 0.010})), 2e-3);
  c.X_start.p = {0, 0, 0.011};
  c.X_wanted = [](double s) {  // out over the edge, where the box drops off, and back on from above
    const double out = std::sin(std::numbers::pi * std::min(1.0, s));
    return Pose{{1, 0, 0, 0}, {0.0155 * out, 0, 0.010 - 0.002 * (1 - out * out) - 0.0005}};
  };
  c.push_W = {0, 0, -1};
  // The push takes the tool down beside the table. What yields lets it up again; 5 N/mm and more hold it there.
  c.hooked_m = 0.015;
  return c;
}

RealCase needle_on(std::string name, geometry::HapticSurface table) {
  RealCase c;
  c.pair = std::make_unique<FeltPair>(std::move(name), std::move(table), untextured(cone_mesh(0.3, 0.010, 24)), 2e-3);
  c.X_start.p.z = 1e-3;
  c.X_wanted = [](double s) {
    return turned_by({{1, 0, 0, 0}, {0.006 * wave(s, 2), 0.002 * wave(s, 1), -0.5e-3 * std::min(1.0, 4 * s)}},
                     {0, 0.2 * wave(s, 1), 0});
  };
  c.push_W = {0, 0, -1};
  return c;
}

RealCase plate_on_plate(std::string name, geometry::HapticSurface table, geometry::HapticSurface tool) {
  RealCase c;
  c.pair = std::make_unique<FeltPair>(std::move(name), std::move(table), std::move(tool));
  c.X_start = {{0, 1, 0, 0}, {0, 0, 1e-3}};
  c.X_wanted = [start = c.X_start](double s) {
    return turned_by(moved_by(start, {0.004 * wave(s, 2), 0, -1.5e-3 * std::min(1.0, 4 * s)}),
                     {0, 0, 0.05 * wave(s, 1)});
  };
  c.push_W = {0, 0, -1};
  return c;
}

std::vector<RealCase> real_cases() {
  const slave_sim::PlateSize table{.size_m = {0.024, 0.020, 0.004}}, tool{.size_m = {0.008, 0.006, 0.004}};
  const auto flat = [](double, double) { return 0.0; };
  std::vector<RealCase> all;
  for (const double clearance_m : {0.3e-3, 0.1e-3, 0.02e-3}) all.push_back(peg_in_hole(clearance_m));
  all.push_back(gear_interlock());
  all.push_back(nut_on_bolt());
  all.push_back(opposed_walls());
  all.push_back(grazing_edge());
  all.push_back(needle_on("needle on a flat plate", slave_sim::height_plate(flat, table)));
  all.push_back(needle_on("needle on ridges of 2 mm", slave_sim::ridged_plate(2e-3, 0.2e-3, table)));
  all.push_back(
      plate_on_plate("flat on flat", slave_sim::height_plate(flat, table), slave_sim::height_plate(flat, tool)));
  all.push_back(plate_on_plate("ridges in ridges, 2 mm", slave_sim::ridged_plate(2e-3, 0.3e-3, table),
                               slave_sim::ridged_plate(2e-3, 0.3e-3, tool)));
  return all;
}

/// Or, where the tool hooks, what the springs of hand, coupling and contact, one behind the other, make of the way that
/// the hand pulls on.
double most_N(const RealCase& tried, double hand_N_per_m, double coupling_N_per_m, double contact_N_per_m) {
  const double pulled_N = tried.hooked_m / (1 / hand_N_per_m + 1 / coupling_N_per_m + 1 / contact_N_per_m);
  return std::max(kMostPushes * kPush_N, std::hypot(pulled_N, kPush_N));
}

LoopCaseRow run(const RealCase& tried, const LoopJob& job) {
  SimulatedDevice device(device_of(job));
  const contact::Material material = material_of(job);
  RemoteAcrossLink remote(*tried.pair, material, job.link, RemoteAcrossLink::options_of(job.rung));
  HapticLoopSettings settings = loop_of(job, {0.05, Eigen::Vector3d(4e-6, 4e-6, 4e-6).asDiagonal()});
  settings.X_WB = tried.X_start * spatial::inverse(device.true_pose());  // the handle begins where the tool does
  HapticLoop loop(device, remote, settings, remote.contacts());
  const double contact_N_per_m = contact::combined(material, material).stiffness_N_per_m;
  const double coupling_N_per_m =
      coupling_for(device.capabilities(), settings.scales, settings.body, job.tick_ns).stiffness_N_per_m;
  LoopWatch watch(job.tick_ns);
  const int a_ms = static_cast<int>(1'000'000 / job.tick_ns);
  const int free = a_ms * (kFree + static_cast<int>(3 * job.link.round_trip_ns / 1'000'000)), moved = a_ms * kMoved,
            end = free + moved + a_ms * kStill;
  const double lean_m = kPush_N / job.grip.stiffness_N_per_m;
  for (int i = 0; i < end; ++i) {
    const double s = std::max(0.0, static_cast<double>(i - free) / moved);
    Pose X_WHand = i < free ? tried.X_start : tried.X_wanted(s);
    X_WHand.p += std::min(1.0, s) * lean_m * tried.push_W;
    device.hold_at(spatial::inverse(settings.X_WB) * X_WHand);
    remote.at(i * job.tick_ns);
    loop.tick({i * job.tick_ns, 0, 0, 0});
    watch.look(loop, 32 * contact_N_per_m, i >= free, i >= end - a_ms * kJudged);
  }
  LoopCaseRow row = row_of(tried.name(), job, watch.figures(loop, device));
  row.passes = is_sound(row.figures, loop) && row.figures.ripple_share <= kMaxRipple &&
               row.figures.largest_N <= most_N(tried, job.grip.stiffness_N_per_m, coupling_N_per_m, contact_N_per_m);
  return row;
}

}  // namespace

std::vector<LoopCaseRow> judge_real_shapes(const LoopCaseChoice& choice) {
  std::vector<LoopJob> jobs;
  for (const local_model::Rung rung : {local_model::Rung::kLinear, local_model::Rung::kTiles})
    for (const transport::LinkSpec& link : links_of(choice, {200}))
      for (const bool is_light : {true, false})  // the lightest tool in the softest hand, and the other way round
        jobs.push_back({rung, is_light ? kSoftGrip : kHardGrip, link, is_light ? 0.001 : 0.1, choice.tick_ns(),
                        choice.stiffness_N_per_m});
  return run_jobs(real_cases(), jobs, choice.only, run);
}

}  // namespace farfeel::bench
