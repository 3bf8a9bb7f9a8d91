// Cases of the loop through the real contact service: shared out to every core, a row each.
#pragma once

#include <cmath>
#include <initializer_list>
#include <utility>
#include <vector>

#include "haptic_core/contact/material.h"
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
  transport::LinkSpec link;
  double mass_kg;
  std::int64_t tick_ns;
  double stiffness_N_per_m = 0;  ///< of a contact; 0: as its material says
  local_model::ContactLaw contact = local_model::ContactLaw::kPenalty;

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

/// The links that a case meets: none, clean ones of these round trips and one that is bad; or none and the chosen one.
[[nodiscard]] inline std::vector<transport::LinkSpec> links_of(const LoopCaseChoice& choice,
                                                               std::initializer_list<std::int64_t> round_trips_ms) {
  std::vector<transport::LinkSpec> links(1);
  if (choice.link) {
    links.push_back(*choice.link);
    return links;
  }
  for (const std::int64_t ms : round_trips_ms) links.push_back({.round_trip_ns = 1'000'000 * ms});
  links.push_back({.round_trip_ns = 100'000'000, .jitter_ns = 10'000'000, .loss = 0.02, .burst = 5});
  return links;
}

[[nodiscard]] inline master_station::HapticLoopSettings loop_of(const LoopJob& job, const tool::MassProperties& body) {
  master_station::HapticLoopSettings settings;
  settings.timing.period_ns = job.tick_ns;
  settings.body = tool::with_mass(body, job.mass_kg);
  settings.local_model.rung = job.rung;
  settings.local_model.contact = job.contact;
  return settings;
}

/// Of either surface, so that a contact is as stiff as the job says.
[[nodiscard]] inline contact::Material material_of(const LoopJob& job, contact::Material own = {}) {
  if (job.stiffness_N_per_m > 0) own.stiffness_N_per_m = 2 * job.stiffness_N_per_m;
  return own;
}

/// The row of a job that has been run, not judged yet.
[[nodiscard]] inline LoopCaseRow row_of(const std::string& name, const LoopJob& job, const LoopFigures& figures) {
  return {.name = name,
          .rung = std::string(local_model::name(job.rung)),
          .grip = std::string(job.grip.name),
          .tick_hz = job.tick_hz(),
          .mass_kg = job.mass_kg,
          .link = job.link,
          .figures = figures};
}

/// run(case, job) -> row, for every job of every case that is chosen, in their order.
template <typename Case, typename Run>
[[nodiscard]] std::vector<LoopCaseRow> run_jobs(const std::vector<Case>& cases, std::vector<LoopJob> jobs,
                                                const LoopCaseChoice& choice, Run&& run) {
  for (LoopJob& job : jobs) job.contact = choice.contact;
  std::vector<std::pair<const Case*, const LoopJob*>> chosen;
  for (const Case& tried : cases) {
    if (tried.name().find(choice.only) == std::string::npos) continue;
    for (const LoopJob& job : jobs) {
      if (!choice.takes || choice.takes(row_of(tried.name(), job, {}))) chosen.emplace_back(&tried, &job);
    }
  }
  std::vector<LoopCaseRow> rows(chosen.size());
  on_all_cores(rows.size(), [&](std::size_t i) { rows[i] = run(*chosen[i].first, *chosen[i].second); });
  return rows;
}

}  // namespace farfeel::bench
