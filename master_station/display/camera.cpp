#include "master_station/display/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfeel::master_station {
namespace {

constexpr double kElevation_rad = 0.52;  // high enough to see into pockets, low enough to see sides
constexpr double kMargin = 1.06;

// The least distance from the box's centre at which all eight corners are inside the picture.
double distance_to_see(const geometry::Box& box, const glm::dvec3& towards_eye, double tan_half_height,
                       double width_per_height) {
  const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0, 0, 1), towards_eye));
  const glm::dvec3 up = glm::cross(towards_eye, right);
  double distance = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 sign((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
    const glm::dvec3 p = 0.5 * sign * box.size();
    const double nearer = glm::dot(p, towards_eye);
    distance = std::max({distance, nearer + std::abs(glm::dot(p, up)) / tan_half_height,
                         nearer + std::abs(glm::dot(p, right)) / (tan_half_height * width_per_height)});
  }
  return distance;
}

}  // namespace

Camera camera_for(const geometry::Box& everything_W, double width_per_height) {
  Camera camera;
  if (everything_W.is_empty()) return camera;
  const double tan_half_height = std::tan(camera.field_of_view_rad / 2);
  double least = std::numeric_limits<double>::infinity();
  camera.target_W = everything_W.centre();
  // In front is -y. A quarter turn to either side of it, never square on: edges tell shape.
  for (const double azimuth_deg : {-62.0, -50.0, -38.0, -26.0, 26.0, 38.0, 50.0, 62.0}) {
    const double azimuth = azimuth_deg * std::numbers::pi / 180;
    const glm::dvec3 towards_eye(std::sin(azimuth) * std::cos(kElevation_rad),
                                 -std::cos(azimuth) * std::cos(kElevation_rad), std::sin(kElevation_rad));
    const double distance = kMargin * distance_to_see(everything_W, towards_eye, tan_half_height, width_per_height);
    if (distance < least) {
      least = distance;
      camera.eye_W = camera.target_W + distance * towards_eye;
    }
  }
  return camera;
}

Camera closer(const Camera& camera, std::span<const glm::dvec3> points_W, double extent_m) {
  geometry::Box box;
  for (const glm::dvec3& p : points_W) box.include(p);
  if (box.is_empty()) return camera;
  Camera near = camera;
  near.target_W = box.centre();
  const double height_m = std::max(extent_m, 1.6 * glm::length(box.size()));
  const double distance = height_m / (2 * std::tan(camera.field_of_view_rad / 2));
  near.eye_W = near.target_W + distance * glm::normalize(camera.eye_W - camera.target_W);
  return near;
}

}  // namespace farfeel::master_station
