#include "tests/bench/collision_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

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
  std::ofstream file(path);
  file << fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" font-family=\"sans-serif\" "
      "font-size=\"11\">\n",
      left + 4.5 * decade, line * (double(rows.size()) + 3));
  for (int k = 0; k <= 4; ++k) {
    file << fmt::format(
        "<line x1=\"{0}\" x2=\"{0}\" y1=\"20\" y2=\"{1}\" stroke=\"#ccc\"/><text x=\"{0}\" y=\"14\">{2:.0f} "
        "us</text>\n",
        x(std::pow(10, k)), line * (double(rows.size()) + 2), std::pow(10, k));
  }
  double y = 2 * line;
  for (const TimingRow& r : rows) {
    const char* colour = r.entrant == "ours" ? "#1b7837" : r.entrant == "fcl" ? "#762a83" : "#b35806";
    file << fmt::format(
        "<text x=\"4\" y=\"{}\">{} {} ({}, seed {})</text><line x1=\"{}\" x2=\"{}\" y1=\"{}\" y2=\"{}\" "
        "stroke=\"{}\" stroke-width=\"7\"/>\n",
        y, r.scene, r.entrant, r.motion, r.seed, x(r.time.p50_us), x(r.time.p99_us) + 1, y - 4, y - 4, colour);
    y += line;
  }
  file << "</svg>\n";
}

}  // namespace farfeel::bench
