#include "tests/bench/collision_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "tests/bench/svg.h"

namespace farfeel::bench {

void write_csv(const std::string& path, const std::vector<TimingRow>& rows) {
  std::ofstream file(path);
  file << "scene,library,motion,seed,p50_us,p95_us,p99_us,max_us,pairs_mean\n";
  for (const TimingRow& r : rows) {
    file << fmt::format("{},{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.2f}\n", r.scene, r.entrant, r.motion, r.seed,
                        r.time.p50_us, r.time.p95_us, r.time.p99_us, r.time.max_us, r.time.pairs_mean);
  }
}

void write_svg(const std::string& path, const std::vector<TimingRow>& rows) {
  const double left = 330, decade = 130, line = 16;
  const auto x = [&](double us) { return left + decade * std::log10(std::max(us, 1.0)); };
  Svg svg(path, {left + 4.5 * decade, line * (double(rows.size()) + 3)}, 11);
  for (int k = 0; k <= 4; ++k) {
    const double at = x(std::pow(10, k));
    svg.line({at, 20}, {at, line * (double(rows.size()) + 2)}, {.colour = "#ccc"});
    svg.words({at, 14}, fmt::format("{:.0f} us", std::pow(10, k)));
  }
  double y = 2 * line;
  for (const TimingRow& r : rows) {
    const char* colour = r.entrant == "ours" ? "#1b7837" : r.entrant == "fcl" ? "#762a83" : "#b35806";
    svg.words({4, y}, fmt::format("{} {} ({}, seed {})", r.scene, r.entrant, r.motion, r.seed));
    svg.line({x(r.time.p50_us), y - 4}, {x(r.time.p99_us) + 1, y - 4}, {.colour = colour, .width_px = 7});
    y += line;
  }
}

}  // namespace farfeel::bench
