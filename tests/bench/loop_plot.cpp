#include "tests/bench/loop_plot.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>

#include "tests/bench/penetration_plot.h"
#include "tests/bench/plot_labels.h"

namespace farfeel::bench {
namespace {

using local_model::Rung;

constexpr std::array<std::pair<Rung, const char*>, 4> kLines{{{Rung::kHeldWrench, "#b0413e"},
                                                              {Rung::kLinear, "#3b6ea5"},
                                                              {Rung::kQuadratic, "#8d6a9f"},
                                                              {Rung::kTiles, "#3a7d44"}}};

double x_px(double rtt_ms) {
  return 70 + 2.3 * rtt_ms;
}

double y_px(double share) {
  return 330 - 100 * std::clamp(std::log10(share / 0.01), 0.0, 3.0);
}

void write_delay_plot(const std::string& path, const std::vector<LoopCell>& cells) {
  double fastest_hz = 0;
  for (const LoopCell& cell : cells) fastest_hz = std::max(fastest_hz, cell.tick_hz);
  std::ofstream out(path);
  fmt::print(out,
             "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 640 400' font-family='sans-serif' font-size='12'>\n"
             "<rect width='100%' height='100%' fill='white'/>\n");
  for (const double share : {0.01, 0.1, 1.0, 10.0})
    fmt::print(out,
               "<path d='M70 {0:.0f} H540' stroke='#ddd'/><text x='62' y='{1:.0f}' text-anchor='end'>{2:g}</text>\n",
               y_px(share), y_px(share) + 4, share);
  for (const double rtt_ms : {0.0, 10.0, 50.0, 100.0, 200.0})
    fmt::print(out, "<text x='{:.0f}' y='350' text-anchor='middle'>{:g}</text>\n", x_px(rtt_ms), rtt_ms);
  fmt::print(out,
             "<text x='300' y='375' text-anchor='middle'>round trip [ms]</text>\n<text x='70' y='20'>rms error of the "
             "force over the true force's own variation, ticks at {:g} kHz</text>\n",
             1e-3 * fastest_hz);
  std::array<double, kLines.size()> ends_px{};
  double x = 0;
  for (std::size_t i = 0; i < kLines.size(); ++i) {
    const auto& [rung, colour] = kLines[i];
    std::map<double, std::pair<double, int>> at;
    for (const LoopCell& cell : cells) {
      if (cell.rung != rung || cell.tick_hz != fastest_hz || cell.loss != 0 || cell.jitter_ms != 0) continue;
      at[cell.rtt_ms].first += cell.replayed.force_share, ++at[cell.rtt_ms].second;
    }
    std::string line;
    for (const auto& [rtt_ms, sum] : at) {
      x = x_px(rtt_ms), ends_px[i] = y_px(sum.first / sum.second);
      line += fmt::format("{}{:.1f} {:.1f} ", line.empty() ? "M" : "L", x, ends_px[i]);
    }
    fmt::print(out, "<path d='{}' fill='none' stroke='{}' stroke-width='2'/>\n", line, colour);
  }
  const auto labels_px = label_heights_px(ends_px);
  for (std::size_t i = 0; i < kLines.size(); ++i)
    fmt::print(out, "<text x='{:.0f}' y='{:.0f}' fill='{}'>{}</text>\n", x + 8, labels_px[i] + 4, kLines[i].second,
               local_model::name(kLines[i].first));
  fmt::print(out, "</svg>\n");
}

}  // namespace

void write_loop_plots(const std::string& folder, const std::vector<LoopCell>& cells) {
  write_delay_plot(folder + "/loop-delay.svg", cells);
  std::vector<PlotPoint> points;
  for (const LoopCell& cell : cells)
    points.push_back({cell.words(), std::string(local_model::name(cell.rung)),
                      cell.replayed.contact_kB_s + cell.replayed.tile_kB_s, cell.replayed.force_share});
  write_pareto_plot(folder + "/loop-bandwidth.svg", "received by the master [kB/s]",
                    "rms error of the force over the true force's variation", points);
}

}  // namespace farfeel::bench
