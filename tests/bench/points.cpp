// Contacts that are no height field, felt as points: how long an answer takes along a motion, and from nothing.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/bench/hardcases_contact.h"
#include "tests/support/quantile.h"
#include "tests/support/solids.h"
#include "tests/support/textured_solids.h"

namespace farfeel::bench {
namespace {

using support::quantile;

using spatial::Pose;

constexpr double kTurn = 2 * std::numbers::pi;

struct Motion {
  std::string name;
  const Touching* pair;
  std::function<Pose(double)> path;  ///< of a phase from 0 to 1
  int frames;                        ///< at 1 kHz
};

struct Times {
  std::vector<double> total_us, points;  ///< of the frames that look at points
  double first_us = 0;                   ///< a fresh service's first answer
  std::size_t frames = 0;
};

/// Of each frame the least of several passes: other work on the machine only adds to them.
Times time_of(const Motion& motion, int passes) {
  Times times;
  std::vector<double> least(static_cast<std::size_t>(motion.frames), 1e12), points(least.size(), 0);
  std::vector<bool> has_points(least.size(), false);
  times.first_us = 1e12;
  for (int pass = 0; pass < passes; ++pass) {
    contact_service::ContactService service = motion.pair->service();
    for (int i = 0; i < motion.frames; ++i) {
      const auto frame = static_cast<std::size_t>(i);
      const Pose pose = motion.path(static_cast<double>(i) / motion.frames);
      const contact_service::StageTimes& t = service.answer(pose_number(static_cast<std::uint32_t>(i), pose)).times;
      least[frame] = std::min(least[frame], t.total_us);
      points[frame] = t.points;
      has_points[frame] = t.point_contacts > 0;
    }
    contact_service::ContactService fresh = motion.pair->service();
    times.first_us = std::min(times.first_us, fresh.answer(pose_number(0, motion.path(0.5))).times.total_us);
  }
  for (std::size_t i = 0; i < least.size(); ++i) {
    if (has_points[i]) times.total_us.push_back(least[i]), times.points.push_back(points[i]);
  }
  times.frames = least.size();
  return times;
}

void run(int passes, bool is_json) {
  const support::Thread thread{
      .radius_m = 4e-3, .depth_m = 1.3e-3, .pitch_m = 1.5e-3, .turns = 1, .sides = 12, .steps = 4};
  constexpr double kClearance_m = 0.1e-3, kPressed_m = 0.1e-3;
  const auto rings = [](const glm::dvec3& p) {
    return 0.02e-3 * (std::cos(kTurn * std::hypot(p.x, p.y) / 0.5e-3) - 1);
  };
  const Touching screw{.s = support::textured(support::bolt_mesh(thread), rings),
                       .t = support::textured(support::nut_mesh(thread, kClearance_m, 3), rings),
                       .tolerance_m = 0.5e-3,
                       .X_WO = {}};
  const double slope = 2 * thread.depth_m / thread.pitch_m,
               up_m = (kClearance_m + kPressed_m * std::hypot(1, slope)) / slope;
  const auto screwed = [&](double phase) {
    const double turn = 0.4 * std::cos(kTurn * phase);
    return Pose{spatial::rotation_from_vector({0, 0, kTurn * turn}), {0, 0, up_m + thread.pitch_m * turn}};
  };
  const auto ridges = [](const glm::dvec3& p) { return 0.05e-3 * (std::cos(kTurn * p.z / 1e-3) - 1); };
  const Touching peg{.s = support::textured(support::tube_mesh(0.010, 0.016, 0.010, 24), ridges),
                     .t = support::textured(support::cylinder_mesh(0.0099, 0.008, 24), ridges),
                     .tolerance_m = 2e-3,
                     .X_WO = {}};
  const auto stirred = [](double phase) {
    const double angle = kTurn * phase;
    return Pose{{1, 0, 0, 0}, {0.3e-3 * std::cos(angle), 0.3e-3 * std::sin(angle), 0.2e-3 * std::sin(3 * angle)}};
  };
  nlohmann::json rows = nlohmann::json::array();
  fmt::print("{:36} {:>8} {:>9} {:>9} {:>9} {:>9} {:>10} {:>10}\n", "answers felt as points", "of", "p50 us", "p99 us",
             "max us", "first us", "points p50", "points max");
  for (const Motion& motion : {Motion{"nut on bolt, at rest", &screw, [&](double) { return screwed(0); }, 200},
                               Motion{"nut on bolt, rim at 25 mm/s", &screw, screwed, 1600},
                               Motion{"nut on bolt, rim at 100 mm/s", &screw, screwed, 400},
                               Motion{"nut on bolt, rim at 400 mm/s", &screw, screwed, 100},
                               Motion{"peg in hole, stirred", &peg, stirred, 400}}) {
    const Times t = time_of(motion, passes);
    const double p50 = quantile(t.total_us, 0.5), p99 = quantile(t.total_us, 0.99), most = quantile(t.total_us, 1);
    const double points = quantile(t.points, 0.5), points_most = quantile(t.points, 1);
    fmt::print("{:36} {:>8} {:9.0f} {:9.0f} {:9.0f} {:9.0f} {:10.0f} {:10.0f}\n", motion.name,
               fmt::format("{}/{}", t.total_us.size(), t.frames), p50, p99, most, t.first_us, points, points_most);
    rows.push_back({{"motion", motion.name},
                    {"answers", t.total_us.size()},
                    {"p50_us", p50},
                    {"p99_us", p99},
                    {"max_us", most},
                    {"first_us", t.first_us},
                    {"points_p50", points},
                    {"points_max", points_most}});
  }
  if (is_json) fmt::print("{}\n", nlohmann::json{{"rows", rows}}.dump());
}

}  // namespace

void add_points(CLI::App& bench) {
  CLI::App* command = bench.add_subcommand(
      "points", "Contacts that are no height field: a textured nut on its bolt, a peg in its hole");
  const auto is_json = std::make_shared<bool>(false);
  const auto passes = std::make_shared<int>(3);
  command->add_flag("--json", *is_json, "One JSON object as the last line");
  command->add_option("--passes", *passes, "over each motion; an answer's time is the least")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->callback([=] { run(*passes, *is_json); });
}

}  // namespace farfeel::bench
