#include "tests/bench/penetration_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/bench/svg.h"

namespace farfeel::bench {
namespace {

constexpr double kWidth = 760, kHeight = 480, kLeft = 70, kBottom = 50, kTop = 20, kRight = 150;
constexpr double kLeast = 1e-4;  // errors below are drawn here
constexpr std::array<const char*, 8> kColours{"#1b6ca8", "#d1495b", "#2e933c", "#edae49",
                                              "#6a4c93", "#00798c", "#8d5524", "#444444"};

/// Decades that hold all values, and where a value stands between them.
struct Axis {
  double low, high, from, to;

  Axis(const std::vector<double>& values, double from_px, double to_px) : from(from_px), to(to_px) {
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    low = std::floor(std::log10(*least));
    high = std::max(low + 1, std::ceil(std::log10(*most)));
  }
  [[nodiscard]] double at(double value) const { return from + (to - from) * (std::log10(value) - low) / (high - low); }
};

}  // namespace

void write_pareto_plot(const std::string& path, const std::string& x_title, const std::string& y_title,
                       const std::vector<PlotPoint>& all_points) {
  std::vector<PlotPoint> points = all_points;
  if (points.empty()) return;
  std::vector<double> xs, ys;
  std::vector<std::string> groups;
  for (PlotPoint& p : points) {
    p.y = std::max(p.y, kLeast);
    xs.push_back(p.x), ys.push_back(p.y);
    if (std::find(groups.begin(), groups.end(), p.group) == groups.end()) groups.push_back(p.group);
  }
  const Axis x(xs, kLeft, kWidth - kRight), y(ys, kHeight - kBottom, kTop);
  Svg svg(path, {kWidth, kHeight});
  for (double decade = x.low; decade <= x.high; ++decade) {
    const double px = x.at(std::pow(10, decade));
    svg.line({px, kTop}, {px, kHeight - kBottom});
    svg.words({px, kHeight - kBottom + 16}, fmt::format("{:g}", std::pow(10, decade)), {.anchor = "middle"});
  }
  for (double decade = y.low; decade <= y.high; ++decade) {
    const double py = y.at(std::pow(10, decade));
    svg.line({kLeft, py}, {kWidth - kRight, py});
    svg.words({kLeft - 6, py}, fmt::format("{:g}", std::pow(10, decade)), {.anchor = "end"});
  }
  svg.words({0.5 * (kLeft + kWidth - kRight), kHeight - 12}, x_title, {.anchor = "middle"});
  svg.words({16, 0.5 * (kTop + kHeight - kBottom)}, y_title, {.anchor = "middle", .is_turned = true});

  std::sort(points.begin(), points.end(), [](const PlotPoint& a, const PlotPoint& b) { return a.x < b.x; });
  std::vector<glm::dvec2> front;
  double best = points.front().y * 2;
  for (const PlotPoint& p : points) {
    if (p.y >= best) continue;
    best = p.y;
    front.emplace_back(x.at(p.x), y.at(p.y));
  }
  svg.curve(front, {.colour = "#888", .dashes = "4 3"});
  for (const PlotPoint& p : points) {
    const auto group = static_cast<std::size_t>(std::find(groups.begin(), groups.end(), p.group) - groups.begin());
    svg.dot({x.at(p.x), y.at(p.y)}, kColours[group % kColours.size()], 0.8,
            fmt::format("{}: {:.3g}, {:.3g}", p.label, p.x, p.y));
  }
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const glm::dvec2 at{kWidth - kRight + 16, kTop + 18 * static_cast<double>(i) + 8};
    svg.dot(at, kColours[i % kColours.size()]);
    svg.words(at + glm::dvec2{10, 4}, groups[i]);
  }
}

}  // namespace farfeel::bench
