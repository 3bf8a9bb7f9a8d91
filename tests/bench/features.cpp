// What each feature of a contact frame costs where a scene has it, and that a scene without it pays nothing: not a
// little, but none of its work.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "haptic_core/collision/hull_tree.h"
#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/models/height_plate.h"
#include "tests/bench/bench.h"
#include "tests/support/solids.h"

namespace farfeel::bench {
namespace {

using contact_service::StageTimes;
using spatial::Pose;

/// One scene, pressed and stroked; what differs between two of them is one feature.
struct Setting {
  geometry::HapticSurface s, t;
  contact::Material material{.static_friction = 0, .dynamic_friction = 0};
  bool has_second_object = false;
  double most_stiffness_N_per_m = 0;
  double tool_z_m = 0;  ///< of the tool's origin when it just touches
  glm::dquat R{1, 0, 0, 0};
};

struct Cost {
  double median_us = 0;
  StageTimes work;  ///< of one answer
  std::size_t tree_nodes = 0;
};

Cost run(const Setting& setting) {
  contact_service::TouchableObject objects[2] = {{.felt = &setting.s, .material = setting.material, .X_WO = {}},
                                                 {.felt = &setting.s, .material = setting.material, .X_WO = {}}};
  objects[1].X_WO.p = {0, 0, -0.1e-3};  // in the same place, a little lower
  contact_service::ContactService service({objects, setting.has_second_object ? 2u : 1u},
                                          {.felt = &setting.t, .material = setting.material, .X_WO = {}},
                                          {.most_stiffness_N_per_m = setting.most_stiffness_N_per_m});
  constexpr int kFrames = 400;
  std::vector<double> times_us;
  Cost cost;
  for (int i = 0; i < kFrames; ++i) {
    const double x_m = 1e-5 * (i % 200);
    const contact_service::Answer& answer =
        service.answer({.sequence = static_cast<std::uint32_t>(i),
                        .time_ns = i * 1'000'000LL,
                        .X_WT = {setting.R, {x_m, 0.3e-3, setting.tool_z_m - 0.3e-3}},
                        .V_WT_W = {}});
    times_us.push_back(answer.times.total_us);
    cost.work.grids = std::max(cost.work.grids, answer.times.grids);
    cost.work.closed_forms = std::max(cost.work.closed_forms, answer.times.closed_forms);
    cost.work.hessians = std::max(cost.work.hessians, answer.times.hessians);
    cost.work.frictions = std::max(cost.work.frictions, answer.times.frictions);
  }
  std::nth_element(times_us.begin(), times_us.begin() + kFrames / 2, times_us.end());
  cost.median_us = times_us[kFrames / 2];
  for (const auto* surface : {&setting.s, &setting.t}) {
    const collision::HullTree tree{collision::ConvexPieces(*surface)};
    cost.tree_nodes += tree.nodes().size() - 1;  // a tree of one node is none
  }
  return cost;
}

struct Feature {
  std::string name, work;  ///< what is counted
  Setting off, on;
  std::function<double(const Cost&)> count;
};

std::vector<Feature> features() {
  constexpr glm::dvec3 kTable_m{0.020, 0.020, 0.010}, kTool_m{0.008, 0.006, 0.004};
  const Setting plain{.s = support::untextured(support::box_mesh(kTable_m)),
                      .t = support::untextured(support::box_mesh(kTool_m)),
                      .tool_z_m = 0.5 * kTable_m.z + 0.5 * kTool_m.z};
  Setting textured{.s = slave_sim::ridged_plate(3e-3, 0.3e-3, {.size_m = kTable_m}),
                   .t = slave_sim::ridged_plate(2e-3, 0.2e-3, {.size_m = kTool_m}),
                   .tool_z_m = 0,
                   .R = {0, 1, 0, 0}};
  Setting pieces = plain;
  pieces.t = support::untextured(support::spur_mesh(24, 0.004, 0.5e-3, kTool_m.z));
  Setting second = plain, rubbing = plain, held = textured;
  second.has_second_object = true;
  rubbing.material = {};
  held.most_stiffness_N_per_m = contact_service::kHeldStiffness_N_per_m;
  return {
      {"texture", "grids an answer", plain, textured, [](const Cost& c) { return double(c.work.grids); }},
      {"several pieces", "tree nodes below the root", plain, pieces,
       [](const Cost& c) { return double(c.tree_nodes); }},
      {"second object", "contacts beyond one", plain, second,
       [](const Cost& c) { return double(c.work.closed_forms) - 1; }},
      {"friction", "states kept", plain, rubbing, [](const Cost& c) { return double(c.work.frictions); }},
      {"held stiffness", "contacts judged an answer", textured, held,
       [](const Cost& c) { return double(c.work.hessians); }},
  };
}

void print_all(bool is_json) {
  nlohmann::json rows = nlohmann::json::array();
  fmt::print("{:16} {:>10} {:>10} {:>10}   {:28} {:>6} {:>6}\n", "feature", "off us", "on us", "cost us",
             "work counted", "off", "on");
  for (const Feature& feature : features()) {
    const Cost off = run(feature.off), on = run(feature.on);
    fmt::print("{:16} {:10.2f} {:10.2f} {:10.2f}   {:28} {:6.0f} {:6.0f}\n", feature.name, off.median_us, on.median_us,
               on.median_us - off.median_us, feature.work, feature.count(off), feature.count(on));
    rows.push_back({{"feature", feature.name},
                    {"off_us", off.median_us},
                    {"on_us", on.median_us},
                    {"cost_us", on.median_us - off.median_us},
                    {"work", feature.work},
                    {"work_off", feature.count(off)},
                    {"work_on", feature.count(on)}});
  }
  if (is_json) fmt::print("{}\n", nlohmann::json{{"rows", rows}}.dump());
}

}  // namespace

void add_features(CLI::App& bench) {
  CLI::App* command = bench.add_subcommand("features", "What each feature of a contact frame costs, on and off");
  const auto is_json = std::make_shared<bool>(false);
  command->add_flag("--json", *is_json, "One JSON object as the last line");
  command->callback([is_json] { print_all(*is_json); });
}

}  // namespace farfeel::bench
