#include "tests/bench/loop_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "tests/bench/penetration_plot.h"
#include "tests/bench/plot_labels.h"
#include "tests/bench/svg.h"

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
  Svg svg(path, {640, 400});
  for (const double share : {0.01, 0.1, 1.0, 10.0}) {
    svg.line({70, y_px(share)}, {540, y_px(share)});
    svg.words({62, y_px(share) + 4}, fmt::format("{:g}", share), {.anchor = "end"});
  }
  for (const double rtt_ms : {0.0, 10.0, 50.0, 100.0, 200.0})
    svg.words({x_px(rtt_ms), 350}, fmt::format("{:g}", rtt_ms), {.anchor = "middle"});
  svg.words({300, 375}, "round trip [ms]", {.anchor = "middle"});
  svg.words({70, 20}, fmt::format("rms error of the force over the true force's own variation, ticks at {:g} kHz",
                                  1e-3 * fastest_hz));
  std::array<double, kLines.size()> ends_px{};
  double x = 0;
  for (std::size_t i = 0; i < kLines.size(); ++i) {
    const auto& [rung, colour] = kLines[i];
    std::map<double, std::pair<double, int>> at;
    for (const LoopCell& cell : cells) {
      if (cell.rung != rung || cell.tick_hz != fastest_hz || cell.loss != 0 || cell.jitter_ms != 0) continue;
      at[cell.rtt_ms].first += cell.replayed.force_share, ++at[cell.rtt_ms].second;
    }
    std::vector<glm::dvec2> line;
    for (const auto& [rtt_ms, sum] : at) {
      x = x_px(rtt_ms), ends_px[i] = y_px(sum.first / sum.second);
      line.emplace_back(x, ends_px[i]);
    }
    svg.curve(line, {.colour = colour, .width_px = 2});
  }
  const auto labels_px = label_heights_px(ends_px);
  for (std::size_t i = 0; i < kLines.size(); ++i)
    svg.words({x + 8, labels_px[i] + 4}, local_model::name(kLines[i].first), {.colour = kLines[i].second});
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
