// Thin walls in closed loop: the hand jabs at 1 m/s, then leans on and holds still. The tool's middle must not get
// through, whatever the link.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "tests/bench/felt_pair.h"
#include "tests/bench/hardcases_jobs.h"
#include "tests/bench/remote_across_link.h"
#include "tests/bench/touch_places.h"
#include "tests/bench/touch_side.h"

namespace farfeel::bench {
namespace {

using namespace master_station;
using spatial::Pose;

constexpr int kFree_ms = 200, kMoved_ms = 1200, kStill_ms = 1000, kJudged_ms = 500;
constexpr double kJab_m_s = 1, kRunUp_m = 0.05;
constexpr double kThrough_s = 0.010;  // behind the wall for longer, with less than half of what should push back

struct JabCase {
  std::string title;
  std::shared_ptr<TouchSubject> subject;
  std::shared_ptr<TouchTool> tool;
  std::shared_ptr<FeltPair> pair;
  Place place;

  [[nodiscard]] const std::string& name() const { return title; }
};

/// The first place whose way out looks along `side`, away from its rim, with room to run up.
JabCase jab_case(const std::string& title, std::shared_ptr<TouchSubject> subject, std::shared_ptr<TouchTool> tool,
                 const glm::dvec3& side) {
  constexpr std::uint32_t kMostTries = 2000;
  for (std::uint32_t i = 0; i < kMostTries; ++i) {
    auto place = place_on(*subject, *tool, 1, i);
    if (!place || glm::dot(place->out_O, side) < 0.9) continue;
    place->free_way_m = free_way_m(*subject, *tool, *place, kRunUp_m);
    if (place->free_way_m < 0.5 * kRunUp_m) continue;
    auto pair = std::make_shared<FeltPair>(title, subject->baked.asset.felt, tool->baked.asset.felt);
    return {title, subject, tool, pair, *place};
  }
  throw std::runtime_error(title + ": no place to jab at");
}

std::vector<JabCase> jab_cases() {
  const std::shared_ptr<TouchTool> ball = touch_tool("ball-6", false);
  const auto subject = [](const char* name, geometry::TriangleMesh mesh) {
    auto baked = kept_asset(name, {std::move(mesh), {}}, false);
    if (!baked) throw std::runtime_error(fmt::format("{}: {}", name, baked.error()));
    return std::make_shared<TouchSubject>(*std::move(baked));
  };
  const auto bowl = subject("bowl-3", bowl_mesh(3)), leaf = subject("leaf-0.5", leaf_mesh(0.5));
  return {jab_case("jab at a bowl of 3 mm, outside", bowl, ball, {0, 0, -1}),
          jab_case("jab at a bowl of 3 mm, inside", bowl, ball, {0, 0, 1}),
          jab_case("jab at a leaf of 0.5 mm", leaf, ball, {0, 0, 1})};
}

LoopCaseRow run(const JabCase& tried, const LoopJob& job) {
  SimulatedDevice device(device_of(job));
  const contact::Material material = material_of(job);
  RemoteAcrossLink remote(*tried.pair, material, job.link, RemoteAcrossLink::options_of(job.rung));
  HapticLoopSettings settings = loop_of(job, {0.05, Eigen::Vector3d(4e-6, 4e-6, 4e-6).asDiagonal()});
  const Pose X_start = tried.place.X_OT(-tried.place.free_way_m);
  settings.X_WB = X_start * spatial::inverse(device.true_pose());
  HapticLoop loop(device, remote, settings, remote.contacts());
  const double contact_N_per_m = contact::combined(material, material).stiffness_N_per_m;
  LoopWatch watch(job.tick_ns);
  SideWatch side(tried.subject->truth, X_start.p);
  const int a_ms = static_cast<int>(1'000'000 / job.tick_ns);
  const int free = a_ms * (kFree_ms + static_cast<int>(3 * job.link.round_trip_ns / 1'000'000)),
            end = free + a_ms * (kMoved_ms + kStill_ms);
  const double lean_m = kPush_N / job.grip.stiffness_N_per_m, dt_s = 1e-9 * static_cast<double>(job.tick_ns);
  double through_s = 0, longest_s = 0;
  for (int i = 0; i < end; ++i) {
    const double gone_m = kJab_m_s * dt_s * std::max(0, i - free);
    const Pose X_WHand = tried.place.X_OT(std::min(lean_m, gone_m - tried.place.free_way_m));
    device.hold_at(spatial::inverse(settings.X_WB) * X_WHand);
    remote.at(i * job.tick_ns);
    loop.tick({i * job.tick_ns, 0, 0, 0});
    const TickRecord did = watch.look(loop, 32 * contact_N_per_m, i >= free, i >= end - a_ms * kJudged_ms);
    const TrueTouch touch = side.move_to(did.X_WT.p, tried.tool->shape.radius_m);
    const double share =
        pushed_back_share(touch, did.F_contact_To_W.force_N, contact_N_per_m, device.capabilities().max_force_N);
    through_s = side.is_behind() && share < 0.5 ? through_s + dt_s : 0;
    longest_s = std::max(longest_s, through_s);
  }
  LoopCaseRow row = row_of(tried.name(), job, watch.figures(loop, device));
  row.passes = is_sound(row.figures, loop) && row.figures.ripple_share <= kMaxRipple && longest_s <= kThrough_s;
  return row;
}

}  // namespace

std::vector<LoopCaseRow> judge_jabs(const LoopCaseChoice& choice) {
  std::vector<LoopJob> jobs;
  for (const local_model::Rung rung : {local_model::Rung::kLinear, local_model::Rung::kTiles})
    for (const transport::LinkSpec& link : links_of(choice, {}))
      for (const Grip& grip : {kSoftGrip, kHardGrip})
        jobs.push_back(
            {rung, grip, link, grip.name == kSoftGrip.name ? 0.001 : 0.1, choice.tick_ns(), choice.stiffness_N_per_m});
  return run_jobs(jab_cases(), jobs, choice, run);
}

}  // namespace farfeel::bench
