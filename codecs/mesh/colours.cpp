#include "codecs/mesh/colours.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfeel::codecs {

// IEC 61966-2-1.
double light_of(std::uint8_t on_screen) {
  const double v = on_screen / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

std::uint8_t on_screen(double light) {
  if (!(light > 0)) return 0;
  const double v = light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(std::min(light, 1.0), 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255 * v));
}

NearestPoint::NearestPoint(std::span<const glm::dvec3> points) : points_(points) {
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (std::isfinite(points[i].x) && std::isfinite(points[i].y) && std::isfinite(points[i].z)) order_.push_back(i);
  }
  sort(0, order_.size(), 0);
}

void NearestPoint::sort(std::size_t first, std::size_t end, int axis) {
  if (end - first < 2) return;
  const std::size_t middle = first + (end - first) / 2;
  const auto at = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(first), at(middle), at(end),
                   [&](std::uint32_t a, std::uint32_t b) { return points_[a][axis] < points_[b][axis]; });
  sort(first, middle, (axis + 1) % 3);
  sort(middle + 1, end, (axis + 1) % 3);
}

std::uint32_t NearestPoint::to(const glm::dvec3& place) const {
  std::uint32_t best = order_.front();
  double best_m2 = std::numeric_limits<double>::infinity();
  look(0, order_.size(), 0, place, best, best_m2);
  return best;
}

void NearestPoint::look(std::size_t first, std::size_t end, int axis, const glm::dvec3& place, std::uint32_t& best,
                        double& best_m2) const {
  if (first == end) return;
  const std::size_t middle = first + (end - first) / 2;
  const glm::dvec3 way = points_[order_[middle]] - place;
  if (const double m2 = glm::dot(way, way); m2 < best_m2) best_m2 = m2, best = order_[middle];
  const int next = (axis + 1) % 3;
  const bool is_before = way[axis] > 0;
  is_before ? look(first, middle, next, place, best, best_m2) : look(middle + 1, end, next, place, best, best_m2);
  if (way[axis] * way[axis] >= best_m2) return;
  is_before ? look(middle + 1, end, next, place, best, best_m2) : look(first, middle, next, place, best, best_m2);
}

}  // namespace farfeel::codecs
