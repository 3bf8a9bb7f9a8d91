// Real shapes in closed loop: the contact service at the far end of a link, the haptic loop, the simulated device and a
// hand that pushes the tool about and then holds it still. What the hand does is a path of the tool's own frame; the
// tool follows it as far as it is let.
#include <algorithm>
#include <cmath>

#include "tests/bench/hardcases_jobs.h"
#include "tests/bench/real_cases.h"
#include "tests/bench/remote_across_link.h"

namespace farfeel::bench {
namespace {

using namespace master_station;
using spatial::Pose;

constexpr int kFree = 200, kMoved = 1200, kStill = 1500, kJudged = 500;  // ms

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
  return run_jobs(real_cases(), jobs, choice, run);
}

}  // namespace farfeel::bench
