// The periodogram of a scan of n heights d apart has lines at k / (n d), 1 <= k <= n / 2. Line 1 and 2 still carry the
// shape that the parabola left and the window's width, and are not counted.
#include "slave_sim/bake/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

namespace farfeel::slave_sim {
namespace {

constexpr int kScan = 128, kFirstLine = 3, kScans = 600, kTries = 6000;
constexpr double kNegligible = 1e-3;
using Scan = std::array<double, kScan>;

/// Follows the surface both ways from a known height; empty where it ends.
std::optional<Scan> scanned(const ChartPlan& chart, const FullSurface& full, const glm::dvec3& middle_H,
                            const glm::dvec2& step_m) {
  const glm::dvec3 z_O = spatial::rotate(chart.X_OH, {0, 0, 1});
  constexpr double kSteepest = 2.5;
  Scan scan{};
  for (const int way : {1, -1}) {
    double before_m = middle_H.z;
    for (int i = way > 0 ? kScan / 2 : kScan / 2 - 1; i >= 0 && i < kScan; i += way) {
      const glm::dvec3 p_H(glm::dvec2(middle_H) + static_cast<double>(i - kScan / 2) * step_m, before_m);
      const auto z = full.height_along(spatial::transform_point(chart.X_OH, p_H), z_O, kSteepest * glm::length(step_m));
      if (!z) return std::nullopt;
      scan[static_cast<std::size_t>(i)] = before_m += *z;
    }
  }
  return scan;
}

/// Takes the best parabola away and applies the window.
void prepare(Scan& scan) {
  const auto remove = [&](auto basis) {
    double dot = 0, square = 0;
    for (int i = 0; i < kScan; ++i) {
      const double b = basis((2.0 * i + 1) / kScan - 1);
      dot += b * scan[static_cast<std::size_t>(i)], square += b * b;
    }
    for (int i = 0; i < kScan; ++i)
      scan[static_cast<std::size_t>(i)] -= dot / square * basis((2.0 * i + 1) / kScan - 1);
  };
  remove([](double) { return 1.0; });
  remove([](double x) { return x; });
  remove([](double x) { return x * x - (1 - 1.0 / (kScan * kScan)) / 3; });  // orthogonal to the others on this grid
  for (int i = 0; i < kScan; ++i) {
    scan[static_cast<std::size_t>(i)] *= 1 - std::cos(2 * std::numbers::pi * (i + 0.5) / kScan);
  }
}

}  // namespace

Fineness fineness(const ChartLayout& layout, const std::vector<BakedChart>& baked, const FullSurface& full,
                  double edge_m, double size_m) {
  const double spacing_m = std::min({layout.texel_m / 4, edge_m / 2, size_m / (5 * kScan)});
  std::vector<std::pair<std::uint32_t, std::uint32_t>> own;  // a sample of charts and texels
  std::mt19937_64 random(3);
  std::uint64_t texels = 0;
  for (const BakedChart& chart : baked) texels += chart.own;
  for (std::uint32_t c = 0; c < baked.size(); ++c) {
    for (std::uint32_t t = 0; t < baked[c].is_own.size(); ++t) {
      if (baked[c].is_own[t] && random() % std::max<std::uint64_t>(1, texels / kTries) == 0) own.emplace_back(c, t);
    }
  }
  std::shuffle(own.begin(), own.end(), random);

  std::array<double, kScan / 2 + 1> power{};
  int scans = 0;
  for (const auto& [c, texel] : own) {
    if (scans == kScans) break;
    const ChartPlan& chart = layout.charts[c];
    const glm::dvec3 middle_H((texel % chart.columns + 0.5) * layout.texel_m,
                              (texel / chart.columns + 0.5) * layout.texel_m, baked[c].heights.heights_m[texel]);
    const double turn = std::numbers::pi * static_cast<double>(random() % 1024) / 1024;
    auto scan = scanned(chart, full, middle_H, spacing_m * glm::dvec2(std::cos(turn), std::sin(turn)));
    if (!scan) continue;
    ++scans;
    prepare(*scan);
    for (int k = kFirstLine; k <= kScan / 2; ++k) {
      glm::dvec2 line(0);
      for (int i = 0; i < kScan; ++i) {
        const double angle = 2 * std::numbers::pi * (k * i % kScan) / kScan;
        line += (*scan)[static_cast<std::size_t>(i)] * glm::dvec2(std::cos(angle), std::sin(angle));
      }
      power[static_cast<std::size_t>(k)] += glm::dot(line, line);
    }
  }
  double whole = 0;
  for (const double p : power) whole += p;
  constexpr double kWindowPower = 1.5;  // mean square of the Hann window as it is scaled here
  Fineness out;
  out.rms_m = scans == 0 ? 0 : std::sqrt(2 * whole / (scans * kWindowPower)) / kScan;
  out.keeping_texel_m = layout.texel_m;
  constexpr double kFlat_m = 1e-7;
  if (out.rms_m < kFlat_m) return out;
  const double line_1_per_m = 1 / (kScan * spacing_m);
  double beyond = 0;
  bool is_kept = false;
  for (int k = kScan / 2; k >= kFirstLine; --k) {
    beyond += power[static_cast<std::size_t>(k)];
    if (k * line_1_per_m * 2 * layout.texel_m > 1) out.lost_share = beyond / whole;
    if (!is_kept && beyond > kNegligible * whole) {
      is_kept = true;
      out.keeping_texel_m = 1 / (2 * k * line_1_per_m);
    }
  }
  return out;
}

}  // namespace farfeel::slave_sim
