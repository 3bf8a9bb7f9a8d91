#include "tests/bench/penetration_plot.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

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
  std::ofstream file(path);
  fmt::print(file,
             "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {} {}' font-family='sans-serif' font-size='12'>\n"
             "<rect width='100%' height='100%' fill='white'/>\n",
             kWidth, kHeight);
  for (double decade = x.low; decade <= x.high; ++decade) {
    const double px = x.at(std::pow(10, decade));
    fmt::print(
        file, "<path d='M{0:.1f} {1}V{2}' stroke='#ddd'/><text x='{0:.1f}' y='{3}' text-anchor='middle'>{4:g}</text>\n",
        px, kTop, kHeight - kBottom, kHeight - kBottom + 16, std::pow(10, decade));
  }
  for (double decade = y.low; decade <= y.high; ++decade) {
    const double py = y.at(std::pow(10, decade));
    fmt::print(file,
               "<path d='M{1} {0:.1f}H{2}' stroke='#ddd'/><text x='{3}' y='{0:.1f}' text-anchor='end'>{4:g}</text>\n",
               py, kLeft, kWidth - kRight, kLeft - 6, std::pow(10, decade));
  }
  fmt::print(file, "<text x='{}' y='{}' text-anchor='middle'>{}</text>\n", 0.5 * (kLeft + kWidth - kRight),
             kHeight - 12, x_title);
  fmt::print(file, "<text transform='translate(16 {}) rotate(-90)' text-anchor='middle'>{}</text>\n",
             0.5 * (kTop + kHeight - kBottom), y_title);

  std::sort(points.begin(), points.end(), [](const PlotPoint& a, const PlotPoint& b) { return a.x < b.x; });
  std::string front;
  double best = points.front().y * 2;
  for (const PlotPoint& p : points) {
    if (p.y >= best) continue;
    best = p.y;
    front += fmt::format("{}{:.1f} {:.1f}", front.empty() ? "M" : "L", x.at(p.x), y.at(p.y));
  }
  fmt::print(file, "<path d='{}' fill='none' stroke='#888' stroke-dasharray='4 3'/>\n", front);
  for (const PlotPoint& p : points) {
    const auto group = static_cast<std::size_t>(std::find(groups.begin(), groups.end(), p.group) - groups.begin());
    fmt::print(file,
               "<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='{}' fill-opacity='0.8'><title>{}: {:.3g}, "
               "{:.3g}</title></circle>\n",
               x.at(p.x), y.at(p.y), kColours[group % kColours.size()], p.label, p.x, p.y);
  }
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const double py = kTop + 18 * static_cast<double>(i) + 8, px = kWidth - kRight + 16;
    fmt::print(file, "<circle cx='{}' cy='{}' r='4' fill='{}'/><text x='{}' y='{}'>{}</text>\n", px, py,
               kColours[i % kColours.size()], px + 10, py + 4, groups[i]);
  }
  fmt::print(file, "</svg>\n");
}

}  // namespace farfeel::bench
