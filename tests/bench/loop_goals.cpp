#include "tests/bench/loop_goals.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/passivity/energy_tank.h"

namespace farfeel::bench {
namespace {

using local_model::Rung;

constexpr double kFresh_kB_s = 130, kSpectrum_dB = 1, kFlat = 0.02, kTickP50_us = 70, kTickP99_us = 110;

/// Where the truth's force passes the tool's origin nearer than this, its torque is a ball's: nothing to have a share
/// of. At 1 N it is 50 uNm, a hundredth of what a hand tells apart.
constexpr double kLeastArm_m = 50e-6;

double most_share(double tick_hz) {
  return tick_hz >= 5000 ? 0.07 : tick_hz >= 2000 ? 0.10 : 0.20;
}

const LoopCell* held_beside(const std::vector<LoopCell>& cells, const LoopCell& cell) {
  const auto found = std::find_if(cells.begin(), cells.end(), [&](const LoopCell& other) {
    return other.rung == Rung::kHeldWrench && other.scene == cell.scene && other.tick_hz == cell.tick_hz &&
           other.rtt_ms == cell.rtt_ms && other.jitter_ms == cell.jitter_ms && other.loss == cell.loss;
  });
  return found == cells.end() ? nullptr : &*found;
}

/// Keeps the largest value and where it was.
struct Worst {
  Goal goal;
  void see(double value, const LoopCell& cell) {
    if (!(value <= goal.value)) goal.value = value, goal.worst = cell.words();
  }
};

Worst worst_of(std::string what, double bound, std::string unit) {
  return {{std::move(what), -std::numeric_limits<double>::infinity(), bound, std::move(unit), ""}};
}

}  // namespace

std::vector<Goal> goals_of(const std::vector<FreshStroke>& strokes) {
  std::vector<Goal> all;
  for (const FreshStroke& stroke : strokes)
    all.push_back({"tiles of a first stroke at 100 mm/s, one contact, " + stroke.scene, stroke.during_kB_s, kFresh_kB_s,
                   "kB/s",
                   fmt::format("{:.0f} kB since the start, with what lies around; {:.0f} kB are needed; {} of {} ticks "
                               "lack heights",
                               stroke.all_kB, stroke.oracle_kB, stroke.ticks_lacking, stroke.ticks)});
  return all;
}

std::vector<Goal> goals(const std::vector<LoopCell>& cells, const std::vector<FreshStroke>& fresh,
                        const TickTimes& seven) {
  std::vector<Goal> all;
  std::vector<double> rates;
  for (const LoopCell& cell : cells)
    if (std::find(rates.begin(), rates.end(), cell.tick_hz) == rates.end()) rates.push_back(cell.tick_hz);
  for (const double rate : rates) {
    const std::string at = fmt::format("at {:.0f} Hz, rtt 10 to 200 ms", rate);
    Worst force = worst_of("tiles' force error, of the held wrench's, " + at, most_share(rate), "");
    Worst torque = worst_of("tiles' torque error, of the held wrench's, " + at, most_share(rate), "");
    Worst arm = worst_of("tiles' force passes beside a ball's middle, rms, " + at, 1e6 * kLeastArm_m, "um");
    Worst flat =
        worst_of(fmt::format("tiles' force error grows with rtt, of the held wrench's, at {:.0f} Hz", rate), kFlat, "");
    for (const LoopCell& cell : cells) {
      const LoopCell* held = held_beside(cells, cell);
      if (cell.rung != Rung::kTiles || cell.tick_hz != rate || cell.rtt_ms < 10 || !held) continue;
      force.see(cell.replayed.force_share / held->replayed.force_share, cell);
      if (cell.replayed.truth_arm_m >= kLeastArm_m) {
        torque.see(cell.replayed.torque_share / held->replayed.torque_share, cell);
      } else {
        arm.see(1e6 * cell.replayed.arm_off_m, cell);
      }
      for (const LoopCell& near : cells) {
        if (near.rung == Rung::kTiles && near.scene == cell.scene && near.tick_hz == rate && near.rtt_ms == 0)
          flat.see((cell.replayed.force_share - near.replayed.force_share) / held->replayed.force_share, cell);
      }
    }
    for (Worst* worst : {&force, &torque, &arm, &flat}) {
      if (std::isfinite(worst->goal.value)) all.push_back(worst->goal);
    }
  }
  Worst spectrum = worst_of("tiles' spectrum off, rms over third octaves", kSpectrum_dB, "dB");
  Worst contact = worst_of("energy out of the contact port, of its bound; all but the held wrench", 1, "");
  Worst device =
      worst_of("energy out of the device port; all but the held wrench", passivity::TankSettings{}.cap_J, "J");
  Worst unstable = worst_of("tiles not stable, cells", 0, "");
  double unstable_cells = 0;
  for (const LoopCell& cell : cells) {
    if (cell.rung == Rung::kHeldWrench) continue;
    contact.see(std::abs(cell.closed.contact_min_J) / cell.closed.contact_bound_J, cell);
    device.see(std::abs(cell.closed.device_min_J), cell);
    if (cell.rung != Rung::kTiles) continue;
    spectrum.see(cell.spectrum().rms_dB, cell);
    if (!cell.is_stable()) ++unstable_cells;
    unstable.see(unstable_cells, cell);
  }
  for (Worst* worst : {&spectrum, &contact, &device, &unstable}) all.push_back(worst->goal);
  for (const Goal& goal : goals_of(fresh)) all.push_back(goal);
  all.push_back({fmt::format("tick that feels {} contacts, p50", seven.contacts), seven.p50_us, kTickP50_us, "us", ""});
  all.push_back({fmt::format("tick that feels {} contacts, p99", seven.contacts), seven.p99_us, kTickP99_us, "us", ""});
  return all;
}

}  // namespace farfeel::bench
