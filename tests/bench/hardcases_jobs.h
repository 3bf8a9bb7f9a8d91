// Cases of the loop through the real contact service: shared out to every core, a row each.
#pragma once

#include <cmath>

#include "haptic_core/local_model/local_model.h"
#include "master_station/devices/grip.h"
#include "master_station/devices/simulated_device.h"
#include "master_station/haptic_loop/haptic_loop.h"
#include "tests/bench/hardcases_loop.h"
#include "tests/bench/on_all_cores.h"
#include "transport/link/link_spec.h"

namespace farfeel::bench {

struct LoopJob {
  local_model::Rung rung;
  master_station::Grip grip;
  double round_trip_s, mass_kg;
  std::int64_t tick_ns;

  [[nodiscard]] double tick_hz() const { return 1e9 / static_cast<double>(tick_ns); }
};

constexpr double kPush_N = 3;
constexpr double kMostPushes = 3;  ///< a wedge or a flank may multiply the hand's push, but not without end

[[nodiscard]] inline master_station::SimulatedDeviceSettings device_of(const LoopJob& job) {
  master_station::SimulatedDeviceSettings settings;
  settings.grip = job.grip;
  settings.explorer.hints.p_TWork_T = {0, 0, 0};
  return settings;
}

[[nodiscard]] inline transport::LinkSpec link_of(const LoopJob& job) {
  transport::LinkSpec link;
  link.round_trip_ns = std::llround(1e9 * job.round_trip_s);
  return link;
}

[[nodiscard]] inline master_station::HapticLoopSettings loop_of(const LoopJob& job, const tool::MassProperties& body) {
  master_station::HapticLoopSettings settings;
  settings.timing.period_ns = job.tick_ns;
  settings.body = tool::with_mass(body, job.mass_kg);
  settings.local_model.rung = job.rung;
  return settings;
}

/// The row of a job that has been run, not judged yet.
[[nodiscard]] inline LoopCaseRow row_of(const std::string& name, const LoopJob& job, const LoopFigures& figures) {
  return {name,
          std::string(local_model::name(job.rung)),
          std::string(job.grip.name),
          job.tick_hz(),
          1e3 * job.round_trip_s,
          job.mass_kg,
          figures,
          false};
}

/// run(case, job) -> row, for every job of every case whose pair's name contains `only`, in their order.
template <typename Case, typename Run>
[[nodiscard]] std::vector<LoopCaseRow> run_jobs(const std::vector<Case>& cases, const std::vector<LoopJob>& jobs,
                                                const std::string& only, Run&& run) {
  std::vector<const Case*> chosen;
  for (const Case& tried : cases) {
    if (tried.pair->name().find(only) != std::string::npos) chosen.push_back(&tried);
  }
  std::vector<LoopCaseRow> rows(chosen.size() * jobs.size());
  on_all_cores(rows.size(), [&](std::size_t i) { rows[i] = run(*chosen[i / jobs.size()], jobs[i % jobs.size()]); });
  return rows;
}

}  // namespace farfeel::bench
