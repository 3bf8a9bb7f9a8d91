#include "tests/bench/ablation_speed.h"

#include <ctime>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "master_station/devices/simulated_device.h"
#include "slave_sim/models/height_plate.h"
#include "tests/bench/benchmark_scenes.h"
#include "tests/bench/hardcases_contact.h"
#include "tests/bench/hardcases_jobs.h"
#include "tests/bench/remote_across_link.h"
#include "tests/support/analytic_remote.h"
#include "tests/support/solids.h"
#include "tests/support/textured_solids.h"

namespace farfeel::bench {
namespace {

using contact_service::ContactOptions;
using contact_service::ContactService;
using spatial::Pose;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kJudged = 4;  ///< poses of a way whose wrench is compared

double thread_us() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

SceneTimes times_of(std::vector<double> us) {
  std::sort(us.begin(), us.end());
  const auto at = [&us](double share) {
    return us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))];
  };
  return {at(0.5), at(0.99)};
}

SceneTimes time_linear_ticks(int ticks) {
  using namespace master_station;
  SimulatedDevice device({});
  test_support::AnalyticRemote remote;
  remote.world.points_T = {{0.04, 0.011, 0}, {0.04, -0.011, 0}, {-0.04, 0.011, 0}, {-0.04, -0.011, 0}};
  remote.world.near_m = 0.02;
  remote.world.amplitude_m = 0.1e-3, remote.world.period_m = 2e-3;
  remote.answer_period_ns = 2'000'000;
  remote.set_link({.round_trip_ns = 50'000'000});
  HapticLoopSettings settings;
  settings.body = tool::with_mass({0.05, Eigen::Vector3d(3e-6, 1.7e-4, 1.7e-4).asDiagonal()}, 0.05);
  HapticLoop loop(device, remote, settings);
  std::vector<double> us;
  for (int i = 0; i < ticks; ++i) {
    Pose X_WHand{{1, 0, 0, 0}, {0.01 * std::sin(kTurn * i / 1000), 0, -0.004}};
    device.hold_at(X_WHand);
    const double before_us = thread_us();
    loop.tick({i * std::int64_t{1'000'000}, 0, 0, 0});
    us.push_back(thread_us() - before_us);
    TickRecord record;
    loop.records().pop(record);
  }
  return times_of(std::move(us));
}

SceneTimes time_tiles_ticks(const FeltPair& pair, int ticks) {
  using namespace master_station;
  SimulatedDevice device({});
  RemoteAcrossLink::Options options = RemoteAcrossLink::options_of(local_model::Rung::kTiles);
  options.knows_heights = true;
  options.answer_period_ns = 20'000'000;  // few ticks have the far end's work in them
  const LoopJob job{local_model::Rung::kTiles, kHardGrip, {}, 0.05, 1'000'000};
  RemoteAcrossLink remote(pair, {}, job.link, options);
  HapticLoopSettings settings = loop_of(job, {0.05, Eigen::Vector3d(4e-6, 4e-6, 4e-6).asDiagonal()});
  const Pose X_start{{0, 1, 0, 0}, {0, 0, 1e-3}};
  settings.X_WB = X_start * spatial::inverse(device.true_pose());
  HapticLoop loop(device, remote, settings, remote.contacts());
  std::vector<double> us;
  for (int i = 0; i < ticks; ++i) {
    Pose X_WHand = X_start;
    X_WHand.p += glm::dvec3{0.004 * std::sin(kTurn * i / 500), 0, -std::min(3e-3, 3e-5 * i)};
    device.hold_at(spatial::inverse(settings.X_WB) * X_WHand);
    remote.at(i * job.tick_ns);
    const double before_us = thread_us();
    loop.tick({i * job.tick_ns, 0, 0, 0});
    us.push_back(thread_us() - before_us);
    TickRecord record;
    loop.records().pop(record);
  }
  return times_of(std::move(us));
}

std::unique_ptr<FeltPair> ridged_plates() {
  return std::make_unique<FeltPair>("plates", slave_sim::ridged_plate(3e-3, 0.5e-3, {.size_m = {0.030, 0.030, 0.004}}),
                                    slave_sim::ridged_plate(2e-3, 0.3e-3, {.size_m = {0.010, 0.008, 0.004}}));
}

Pose over_plates(double phase) {
  const double angle = kTurn * phase;
  return {spatial::rotation_from_vector({0.01 * std::sin(angle), 0.01 * std::cos(2 * angle), 0.2 * std::sin(angle)}) *
              kTurnedOver,
          {4e-3 * std::cos(angle), 4e-3 * std::sin(angle), -0.2e-3}};
}

}  // namespace

/// A tool led along a path, answered at each pose.
struct AblationScenes::Walk {
  std::unique_ptr<FeltPair> pair;
  ContactOptions options;
  double dt_s = 1e-3;
  int answers = 400;
  std::function<Pose(double)> path;  ///< of a phase from 0 to 1
  bool has_truth = true;
  std::vector<spatial::Wrench> truth;  ///< at kJudged poses, evenly

  [[nodiscard]] ContactService service(const ContactOptions& with) const {
    const contact::Material smooth{.static_friction = 0, .dynamic_friction = 0};
    const contact_service::TouchableObject S = pair->object(smooth);
    return {{&S, 1}, pair->tool(smooth), with};
  }
  [[nodiscard]] Pose at(int i) const { return path(static_cast<double>(i) / answers); }
  [[nodiscard]] int judged(int k) const { return answers * (2 * k + 1) / (2 * kJudged); }
};

AblationScenes::AblationScenes() {
  using namespace support;
  const auto add = [this](std::unique_ptr<FeltPair> pair, double tolerance_m, std::function<Pose(double)> path,
                          int answers) -> Walk& {
    walks_.push_back(std::make_unique<Walk>());
    Walk& walk = *walks_.back();
    walk.pair = std::move(pair), walk.path = std::move(path), walk.answers = answers;
    walk.options = walk.pair->options();
    walk.options.tolerance_m = tolerance_m;
    return walk;
  };
  add(ridged_plates(), 5e-3, over_plates, 400);
  add(
      ridged_plates(), 5e-3, [](double phase) { return over_plates(0.08 * phase); }, 400)
      .has_truth = false;
  const Thread thread{.radius_m = 4e-3, .depth_m = 1.3e-3, .pitch_m = 1.5e-3, .turns = 1, .sides = 12, .steps = 4};
  constexpr double kClearance_m = 0.1e-3, kPressed_m = 0.1e-3;
  const auto rings = [](const glm::dvec3& p) {
    return 0.02e-3 * (std::cos(kTurn * std::hypot(p.x, p.y) / 0.5e-3) - 1);
  };
  const double slope = 2 * thread.depth_m / thread.pitch_m,
               up_m = (kClearance_m + kPressed_m * std::hypot(1, slope)) / slope;
  add(
      std::make_unique<FeltPair>("screw", textured(bolt_mesh(thread), rings),
                                 textured(nut_mesh(thread, kClearance_m, 3), rings)),
      0.5e-3,
      [=](double phase) {
        const double turn = 0.4 * std::cos(kTurn * phase);
        return Pose{spatial::rotation_from_vector({0, 0, kTurn * turn}), {0, 0, up_m + thread.pitch_m * turn}};
      },
      200)
      .has_truth = false;  // no converged integral knows layers
  add(
      std::make_unique<FeltPair>("peg", untextured(tube_mesh(0.010, 0.016, 0.020, 48)),
                                 untextured(cylinder_mesh(0.0097, 0.030, 48))),
      2e-3,
      [](double phase) {
        const double angle = kTurn * phase, aside_m = 0.5e-3 + 0.1e-3 * std::cos(3 * angle);
        return Pose{{1, 0, 0, 0}, aside_m * glm::dvec3{std::cos(angle), std::sin(angle), 0}};
      },
      1000);
  constexpr int kFrames = 600;
  const BenchmarkScene file = benchmark_scene("file-cad");
  const auto motion = std::make_shared<std::vector<Pose>>(file.motion(1, kFrames));
  const auto along = [motion](double phase) {
    const double at = phase * (kFrames - 1);
    const auto i = std::min<std::size_t>(static_cast<std::size_t>(at), kFrames - 2);
    const Pose &a = (*motion)[i], &b = (*motion)[i + 1];
    const double share = at - static_cast<double>(i);
    return Pose{glm::slerp(a.R, b.R, share), glm::mix(a.p, b.p, share)};
  };
  const auto pair = [&file] { return std::make_unique<FeltPair>("file", file.object.felt, file.tool.felt); };
  add(pair(), file.tolerance_m, along, kFrames).has_truth = false;  // the longest by far
  Walk& tick = add(
      pair(), file.tolerance_m, [along](double phase) { return along(0.5 * phase); }, 2 * kFrames);
  tick.has_truth = false;
  tick.dt_s = 0.25e-3;
  tick.options.most_searches = 2;  // as local_contacts.cpp
}
AblationScenes::~AblationScenes() = default;

const AblationScenes::Walk* AblationScenes::walk_of(Scene scene) const {
  const auto i = static_cast<std::size_t>(scene);
  return i < walks_.size() ? walks_[i].get() : nullptr;
}

SceneTimes AblationScenes::walk(Scene scene, bool is_short) const {
  const int part = is_short ? 10 : 1;
  if (scene == Scene::kLinearTick) return time_linear_ticks(4000 / part);
  if (scene == Scene::kTilesTick) return time_tiles_ticks(*walks_[0]->pair, 1000 / part);
  const Walk& walk = *walk_of(scene);
  ContactService service = walk.service(walk.options);
  std::vector<double> us;
  for (int i = 0; i < walk.answers / part; ++i) {
    const double before_us = thread_us();
    static_cast<void>(service.answer(pose_number(static_cast<std::uint32_t>(i), walk.at(i), walk.dt_s)));
    us.push_back(thread_us() - before_us);
  }
  return times_of(std::move(us));
}

void AblationScenes::look_up_truth() {
  for (const std::unique_ptr<Walk>& walk : walks_) {
    if (!walk->has_truth) continue;
    ContactOptions options = walk->options;
    options.maker = kTruthMaker;
    options.grid_samples = 200;
    options.most_searches = 0;
    for (int k = 0; k < kJudged; ++k) {
      ContactService fresh = walk->service(options);
      walk->truth.push_back(fresh.answer(pose_number(0, walk->at(walk->judged(k)))).F_To_W);
    }
  }
}

std::optional<double> AblationScenes::wrench_off(Scene scene) const {
  const Walk* const walk = walk_of(scene);
  if (!walk || walk->truth.empty()) return std::nullopt;
  ContactService service = walk->service(walk->options);
  double sum = 0;
  int next = 0;
  for (int i = 0; next < kJudged; ++i) {
    const contact::ContactSet& set =
        service.answer(pose_number(static_cast<std::uint32_t>(i), walk->at(i), walk->dt_s));
    if (i == walk->judged(next)) sum += wrench_error(set.F_To_W, walk->truth[static_cast<std::size_t>(next++)]);
  }
  return sum / kJudged;
}

}  // namespace farfeel::bench
