#include "tests/end_to_end/faults/outages.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/bench/on_all_cores.h"
#include "tests/support/guarded_rig.h"

namespace farfeel::end_to_end {
namespace {

using master_station::Grip;
using master_station::TickRecord;

constexpr double kTick_s = 1e-3;
constexpr double kBefore_s = 1.2;   // a first touch, and force that is steady
constexpr double kReturns_s = 1.5;  // after the link is there again
constexpr double kLetGo_s = 0.6;    // 0.25 s until the force fades, 0.3 s in which it does, and a tick or two
constexpr double kNoForce_N = 1e-3;
constexpr std::array kGrips{master_station::kSoftGrip, master_station::kMediumGrip, master_station::kHardGrip};
constexpr std::array kModels{"simulated", "simulated-late", "simulated-slow", "falcon"};

struct Outage {
  std::string what, violation;
  std::uint64_t played_old = 0;
  double step_N_per_s = 0;
  bool is_back = true;
};

Outage survive(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  const auto log_uniform = [&](double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); };
  const Grip& grip = kGrips[random() % kGrips.size()];
  const std::string model = kModels[random() % kModels.size()];
  const double surface_N_per_m = log_uniform(300, 5000), press_N = uniform(1, 3), outage_s = log_uniform(0.02, 5);
  const double round_trip_s = random() % 2 == 0 ? 0 : uniform(0, 0.1), jitter_s = 0.1 * round_trip_s;
  const double sways_m = uniform(0, 0.005), sways_Hz = uniform(0.2, 1), begins_s = kBefore_s + uniform(0, 0.5);

  devices::GuardedRig rig(grip, *devices::find_model(model), surface_N_per_m);
  rig.remote.set_link({.round_trip_ns = std::llround(1e9 * round_trip_s), .jitter_ns = std::llround(1e9 * jitter_s)},
                      seed);
  const double press_m = press_N * (1 / grip.stiffness_N_per_m + 1 / surface_N_per_m);
  rig.device.start_at({{1, 0, 0, 0}, {0, 0, 0.01}});

  Outage outage;
  outage.what = fmt::format("seed {}: {}, {} grip, {:.1f} N, {:.0f} N/m, round trip {:.0f} ms, out for {:.3f} s", seed,
                            model, grip.name, press_N, surface_N_per_m, 1e3 * round_trip_s, outage_s);
  const double ends_s = begins_s + outage_s;
  double last_N = 0, before_N = 0;
  for (double t_s = 0; t_s < ends_s + round_trip_s + kReturns_s; t_s += kTick_s) {
    const double down_m =
        std::clamp(0.05 * (t_s - 0.3), 0.0, 0.007 + press_m);  // the tool's points are 3 mm below the handle
    rig.device.hold_at({{1, 0, 0, 0}, {sways_m * std::sin(2 * std::numbers::pi * sways_Hz * t_s), 0, 0.01 - down_m}});
    rig.remote.is_silent = t_s >= begins_s && t_s < ends_s;
    const TickRecord record = rig.tick();
    const double force_N = glm::length(record.F_hand_W.force_N);
    if (t_s < begins_s) before_N = force_N;
    if (t_s > begins_s + round_trip_s + kLetGo_s && t_s < ends_s &&
        glm::length(record.F_contact_To_W.force_N) > kNoForce_N)
      ++outage.played_old;
    // A sway of the hand is no return: only what comes up against the hand counts.
    if (t_s >= ends_s && force_N > last_N)
      outage.step_N_per_s = std::max(outage.step_N_per_s, (force_N - last_N) / kTick_s);
    last_N = force_N;
  }
  outage.is_back = last_N > 0.5 * before_N;
  if (outage.played_old > 0) outage.violation += fmt::format(" old force in {} ticks;", outage.played_old);
  constexpr double kRounding = 1 + 1e-9;
  if (outage.step_N_per_s > kRounding * kMostReturn_N_per_s)
    outage.violation += fmt::format(" force returned by {:.0f} N/s;", outage.step_N_per_s);
  if (!outage.is_back)
    outage.violation += fmt::format(" {:.2f} N of {:.2f} came back, {};", last_N, before_N, message(rig.loop.fault()));
  return outage;
}

}  // namespace

OutagesResult survive_outages(std::size_t count, std::uint64_t seed) {
  std::vector<Outage> outages(count);
  bench::on_all_cores(count, [&](std::size_t i) { outages[i] = survive(seed + i); });
  OutagesResult result;
  result.outages = count;
  for (const Outage& outage : outages) {
    result.played_old += outage.played_old;
    result.step_N_per_s_max = std::max(result.step_N_per_s_max, outage.step_N_per_s);
    result.not_back += outage.is_back ? 0 : 1;
    if (!outage.violation.empty()) result.words.push_back(outage.what + ":" + outage.violation);
  }
  return result;
}

}  // namespace farfeel::end_to_end
