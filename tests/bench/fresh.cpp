// Ground that the tool has not been on: how much deeper it sinks at a first touch behind a link than without one, and
// on how many ticks of a stroke heights are late.
//
// The hand is stiff here: it goes its way whatever it feels, so that both ends of a comparison go the same. Sessions
// with hands that give way are measured elsewhere.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "slave_sim/models/height_plate.h"
#include "slave_sim/models/roughness.h"
#include "tests/bench/bench.h"
#include "tests/bench/loop_replay.h"
#include "tests/bench/stroked_scenes.h"
#include "tests/support/solids.h"

namespace farfeel::bench {
namespace {

using contact_service::ToolPose;
using local_model::Rung;

constexpr double kTick_s = 1e-3, kFelt_N = 0.05;
constexpr double kStroke_m = 0.120, kStrokeStart_m = -0.060;
constexpr double kMostExtra_m = 0.3e-3, kMostLate = 0.01, kMostRtt_ms = 200;
const glm::dquat kTurnedOver{0, 1, 0, 0};

geometry::HapticSurface long_plate(double texel_m, double waves_m, double rms_m, double width_m = 0.030) {
  const slave_sim::PlateSize size{.size_m = {0.160, width_m, 0.004}, .texel_m = texel_m};
  return slave_sim::height_plate(
      [=](double x, double y) {
        double z = 0;
        for (int k = 0; k < 12; ++k) {
          const double wave = 2 * std::numbers::pi / (waves_m * std::pow(1.115, k)), angle = 2.4 * k;
          z += 0.4 * rms_m * std::cos(wave * (std::cos(angle) * x + std::sin(angle) * y) + 1.7 * k);
        }
        return z;
      },
      size);
}
geometry::HapticSurface curved_plate() {
  return slave_sim::ridged_plate(0.012, 0.3e-3, {.size_m = {0.006, 0.005, 0.004}});
}

/// wide: a hand that starts may go every way, so more tiles lie around it than on a narrow plate. fine: four times the
/// tiles, each of more bytes: at 300 mm/s about 1 MB/s, twice what the feed may send.
std::vector<std::unique_ptr<StrokedScene>> long_scenes() {
  std::vector<std::unique_ptr<StrokedScene>> scenes;
  const auto add = [&](std::string name, geometry::HapticSurface object) {
    scenes.push_back(
        std::make_unique<StrokedScene>(std::move(name), std::move(object), curved_plate(), kTurnedOver, 0));
  };
  add("ridges", slave_sim::ridged_plate(1.5e-3, 0.1e-3, {.size_m = {0.160, 0.030, 0.004}}));
  add("rough", long_plate(0.1e-3, 1.2e-3, 40e-6));
  add("fine", long_plate(0.05e-3, 0.4e-3, 15e-6));
  add("wide", long_plate(0.1e-3, 1.2e-3, 40e-6, 0.100));
  add("lumps", long_plate(0.1e-3, 4e-3, 250e-6));
  return scenes;
}

struct LateRow {
  std::string scene;
  double speed_m_s = 0, rtt_ms = 0;
  Replayed replayed;
};

std::vector<LateRow> strokes_on_fresh_ground(const std::vector<std::unique_ptr<StrokedScene>>& scenes,
                                             const std::vector<double>& speeds_m_s,
                                             const std::vector<double>& rtts_ms) {
  std::vector<LateRow> rows;
  fmt::print("strokes of {:.0f} mm on fresh ground, tiles, 1 kHz\n{:10} {:>6} {:>7} {:>8} {:>8} {:>9} {:>9}\n",
             1e3 * kStroke_m, "scene", "mm/s", "rtt ms", "late", "force", "tile kB/s", "tile kB");
  for (const auto& scene : scenes) {
    for (const double speed_m_s : speeds_m_s) {
      const ReplayTruth truth(*scene, {{speed_m_s, kStroke_m, 1}}, kStrokeStart_m);
      for (const double rtt_ms : rtts_ms) {
        LateRow row{scene->name(), speed_m_s, rtt_ms, {}};
        row.replayed = replay(truth, Rung::kTiles, 1 / kTick_s, {.round_trip_ns = std::llround(1e6 * rtt_ms)});
        fmt::print("{:10} {:6.0f} {:7.0f} {:8.4f} {:8.3f} {:9.1f} {:9.1f}\n", row.scene, 1e3 * speed_m_s, rtt_ms,
                   row.replayed.late_share, row.replayed.force_share, row.replayed.tile_kB_s, row.replayed.all_tile_kB);
        rows.push_back(std::move(row));
      }
    }
  }
  return rows;
}

/// A straight way of the tool's origin, from above into the surface.
struct Approach {
  double down_m_s, along_m_s;
  /// rest: the pose that just touches, or so; contact comes `wait_s` after the start at the earliest.
  [[nodiscard]] ToolPose at(const spatial::Pose& rest, double t_s, double wait_s, std::uint32_t sequence) const {
    ToolPose pose{sequence, std::llround(1e9 * t_s), rest, {{}, {along_m_s, 0, -down_m_s}}};
    pose.X_WT.p += (t_s - wait_s) * pose.V_WT_W.linear_m_s;
    return pose;
  }
};

struct FirstTouch {
  double depth_m = 0, at_s = 0, most_by_outline_m = 0;
};

/// Where the force is first felt, by the true depth there.
FirstTouch first_touch(const FeltPair& pair, const spatial::Pose& rest, const Approach& approach, Rung rung,
                       const transport::LinkSpec& link, std::uint64_t seed) {
  RemoteAcrossLink remote(pair, kWithoutLoss, link, RemoteAcrossLink::options_of(rung), seed);
  contact_service::ContactService truth = pair.service(kWithoutLoss);
  local_model::LocalContacts* local = remote.contacts();
  local_model::LocalModelSettings settings;
  settings.rung = rung;
  local_model::LocalModel model(settings);
  contact::ContactSet newest;
  FirstTouch touch;
  const double wait_s = 0.4 + 3e-9 * static_cast<double>(link.round_trip_ns) + 0.01 / approach.down_m_s;
  for (std::uint32_t i = 1; i < 100'000; ++i) {
    const double t_s = kTick_s * i;
    // Waits well above, then goes: what was told there is old by then.
    const ToolPose hand = approach.at(rest, std::max(t_s, wait_s - 0.008 / approach.down_m_s), wait_s, i);
    ToolPose now = hand;
    now.time_ns = std::llround(1e9 * t_s);
    remote.at(now.time_ns);
    model.advance(kTick_s, now.X_WT);
    if (remote.poll(newest)) {
      if (local) {
        local->hear(newest), model.hear(newest);
      } else {
        model.update(newest, now.X_WT, 1e-9 * static_cast<double>(now.time_ns - newest.pose_time_ns));
      }
    }
    if (local) model.refresh(rung == Rung::kTiles ? local->at(now) : local->beside_remote(now), now.X_WT);
    const local_model::Felt felt = model.evaluate(now.X_WT, now.V_WT_W, kTick_s);
    const spatial::Vector6 V = spatial::to_vector6(now.V_WT_W);
    const spatial::Vector6 F = felt.response.F_To_W + kTick_s * felt.response.mean_by_way * V;
    model.settle(F, V, kTick_s, spatial::integrate(now.X_WT, now.V_WT_W, kTick_s));
    remote.send({i, now.time_ns, now.X_WT, now.V_WT_W});
    if (F.tail<3>().norm() < kFelt_N) continue;
    const contact::ContactSet& there = truth.answer(now);
    for (std::uint32_t c = 0; c < there.count; ++c) touch.depth_m = std::max(touch.depth_m, there.contacts[c].depth_m);
    touch.at_s = t_s;
    return touch;
  }
  touch.depth_m = std::numeric_limits<double>::infinity();
  return touch;
}

struct Options {
  bool as_json = false;
  std::vector<double> speeds_m_s{0.1, 0.2, 0.3}, rtts_ms{100, 200, 300};
};

void run(const Options& options) {
  const auto scenes = long_scenes();
  nlohmann::json strokes = nlohmann::json::array(), touches = strokes;
  std::vector<std::pair<std::string, double>> most_late;  // of each scene, behind up to 200 ms
  for (const LateRow& row : strokes_on_fresh_ground(scenes, options.speeds_m_s, options.rtts_ms)) {
    if (most_late.empty() || most_late.back().first != row.scene) most_late.emplace_back(row.scene, 0.0);
    if (row.rtt_ms <= kMostRtt_ms) most_late.back().second = std::max(most_late.back().second, row.replayed.late_share);
    strokes.push_back({{"scene", row.scene},
                       {"speed_m_s", row.speed_m_s},
                       {"rtt_ms", row.rtt_ms},
                       {"late_share", row.replayed.late_share},
                       {"force_rmse_share", row.replayed.force_share},
                       {"tile_kB_s", row.replayed.tile_kB_s},
                       {"all_tile_kB", row.replayed.all_tile_kB}});
  }
  const transport::LinkSpec bad{.round_trip_ns = 100'000'000, .jitter_ns = 10'000'000, .loss = 0.02, .burst = 5};
  fmt::print(
      "\nfirst touch behind rtt=100ms jitter=10ms loss=2%,burst=5, deeper than without a link\n{:10} {:10} {:>9} "
      "{:>9} {:>9} {:>9}\n",
      "scene", "rung", "down mm/s", "along", "extra mm", "late ms");
  const FeltPair plain("plain", support::untextured(support::cylinder_mesh(0.03, 0.01, 96)),
                       support::untextured(support::cylinder_mesh(0.003, 0.004, 48)));
  std::vector<std::pair<const FeltPair*, spatial::Pose>> pairs;
  for (const auto& scene : scenes) pairs.emplace_back(scene.get(), scene->X_WT(0, 0, 0, 0));
  pairs.emplace_back(&plain, spatial::Pose{{1, 0, 0, 0}, {0, 0, 0.007}});
  double most_extra_m = 0;
  for (const auto& [pair, rest] : pairs) {
    for (const Rung rung : {Rung::kTiles, Rung::kLinear, Rung::kQuadratic}) {
      for (const Approach approach :
           {Approach{0.01, 0.0}, {0.05, 0.0}, {0.1, 0.0}, {0.3, 0.0}, {0.1, 0.1}, {0.05, 0.2}}) {
        double extra_m = 0, late_s = 0;
        for (std::uint64_t seed = 1; seed <= 2; ++seed) {
          spatial::Pose there = rest;
          there.p += glm::dvec3{0.003 * static_cast<double>(seed), 0.001, 0};
          const FirstTouch far = first_touch(*pair, there, approach, rung, bad, seed);
          const FirstTouch near = first_touch(*pair, there, approach, rung, {}, seed);
          const double wait_s = 3e-9 * static_cast<double>(bad.round_trip_ns);
          extra_m = std::max(extra_m, far.depth_m - near.depth_m);
          late_s = std::max(late_s, far.at_s - near.at_s - wait_s);
        }
        most_extra_m = std::max(most_extra_m, extra_m);
        fmt::print("{:10} {:10} {:9.0f} {:9.0f} {:9.3f} {:9.1f}\n", pair->name(), local_model::name(rung),
                   1e3 * approach.down_m_s, 1e3 * approach.along_m_s, 1e3 * extra_m, 1e3 * late_s);
        touches.push_back({{"scene", pair->name()},
                           {"rung", local_model::name(rung)},
                           {"down_m_s", approach.down_m_s},
                           {"along_m_s", approach.along_m_s},
                           {"extra_mm", 1e3 * extra_m},
                           {"late_ms", 1e3 * late_s}});
      }
    }
  }
  fmt::print("\n");
  for (const auto& [scene, late] : most_late)
    fmt::print("{} {:.4f} (goal {:.2f}): ticks with late heights behind up to {:.0f} ms, {}\n",
               late <= kMostLate ? "met    " : "NOT MET", late, kMostLate, kMostRtt_ms, scene);
  fmt::print("{} {:.3f} mm (goal {:.1f}): deeper at first touch than without a link\n",
             most_extra_m <= kMostExtra_m ? "met    " : "NOT MET", 1e3 * most_extra_m, 1e3 * kMostExtra_m);
  if (options.as_json) fmt::print("{}\n", nlohmann::json{{"strokes", strokes}, {"first_touch", touches}}.dump());
}

}  // namespace

void add_fresh(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app =
      bench.add_subcommand("fresh", "Ground not felt before: late heights on strokes, depth at first touch");
  app->add_option("--speeds", options->speeds_m_s, "Of the strokes [m/s]")->capture_default_str();
  app->add_option("--rtts", options->rtts_ms, "Of the links they are made behind [ms]")->capture_default_str();
  app->add_flag("--json", options->as_json, "One object as the last line");
  app->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
