#include "tests/bench/hardcases_contact.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "tests/bench/bench.h"
#include "tests/bench/known_failures.h"

namespace farfeel::bench {

using contact::Contact;
using contact::ContactSet;

contact_service::ContactService Touching::service(const penetration::BackEndMaker& maker, std::uint32_t samples,
                                                  double soft_width_m) const {
  const contact::Material smooth{.static_friction = 0, .dynamic_friction = 0};
  const contact_service::TouchableObject object{.felt = &s, .material = smooth, .X_WO = X_WO};
  return {{&object, 1},
          {.felt = &t, .material = {}, .X_WO = {}},
          {.tolerance_m = tolerance_m, .grid_samples = samples, .soft_width_m = soft_width_m, .maker = maker}};
}

ContactSet Touching::answer(const spatial::Pose& X_OT, const penetration::BackEndMaker& maker, std::uint32_t samples,
                            double soft_width_m) const {
  contact_service::ContactService fresh = service(maker, samples, soft_width_m);
  return fresh.answer(pose_number(0, X_WO * X_OT));
}

contact_service::ToolPose pose_number(std::uint32_t i, const spatial::Pose& X_WT, double dt_s) {
  return {.sequence = i, .time_ns = std::llround(1e9 * dt_s * i), .X_WT = X_WT, .V_WT_W = {}};
}

Contact deepest_of(const ContactSet& set) {
  Contact deepest;
  deepest.depth_m = std::nan("");
  for (std::uint32_t i = 0; i < set.count; ++i) {
    if (!(set.contacts[i].depth_m <= deepest.depth_m)) deepest = set.contacts[i];
  }
  return deepest;
}

bool is_finite(const ContactSet& set) {
  bool is_fine = spatial::is_finite(set.F_To_W);
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const Contact& c = set.contacts[i];
    is_fine = is_fine && std::isfinite(c.depth_m) && c.gradient.allFinite() && spatial::is_finite(c.p_WC_W) &&
              spatial::is_finite(c.nhat_ST_W);
  }
  return is_fine;
}

double wrench_error(const spatial::Wrench& F, const spatial::Wrench& truth) {
  constexpr double kArm_m = 0.02;
  const auto size = [](const spatial::Wrench& w) {
    return std::hypot(glm::length(w.force_N), glm::length(w.torque_Nm) / kArm_m);
  };
  return size(F + -1.0 * truth) / size(truth);
}

std::vector<HardCase> contact_cases() {
  std::vector<HardCase> all;
  for (const auto& cases : {height_field_cases, solid_cases, shell_cases, closed_path_cases}) {
    for (const HardCase& one : cases()) all.push_back(one);
  }
  return all;
}

void add_hardcases_contact(CLI::App& hardcases) {
  CLI::App* command = hardcases.add_subcommand(
      "contact", "Of one contact frame: pegs, threads, edges, layers, ridges, shells, distances");
  const auto is_json = std::make_shared<bool>(false), is_untimed = std::make_shared<bool>(false);
  command->add_flag("--json", *is_json, "One JSON object as the last line");
  command->add_flag("--untimed", *is_untimed, "Without the rows whose bound is a time: their verdict is the machine's");
  command->callback([is_json, is_untimed] {
    HardCaseRows rows;
    for (const HardCase& one : contact_cases()) one.judge(rows);
    if (*is_untimed) std::erase_if(rows, [](const HardCaseRow& row) { return row.unit == "ms"; });
    CountedRows counted;
    nlohmann::json out = nlohmann::json::array();
    fmt::print("{:44} {:44} {:>12} {:>10} {:8} {}\n", "case", "figure", "value", "bound", "unit", "verdict");
    for (const HardCaseRow& row : rows) {
      fmt::print("{:44} {:44} {:12.4g} {:10.4g} {:8} {}\n", row.name, row.figure, row.value, row.bound, row.unit,
                 counted.count(HardCases::kContact, row.passes(), row.name, row.figure));
      out.push_back({{"case", row.name},
                     {"figure", row.figure},
                     {"value", row.value},
                     {"unit", row.unit},
                     {"bound", row.bound},
                     {"passes", row.passes()},
                     {"known", known_failure(HardCases::kContact, row.name, row.figure)}});
    }
    counted.print();
    if (*is_json)
      fmt::print("{}\n",
                 nlohmann::json{{"rows", out}, {"failed", counted.failed()}, {"unknown", counted.unknown()}}.dump());
    if (counted.unknown() > 0) throw CLI::RuntimeError(1);
  });
}

}  // namespace farfeel::bench
