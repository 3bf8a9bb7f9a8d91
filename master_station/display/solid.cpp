#include "master_station/display/solid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfeel::master_station {
namespace {

constexpr float kCosCrease = 0.574F;  // 55 degrees
constexpr int kSides = 24;

// The faces around each vertex, one vertex after the other: those of v are faces[first[v]] .. faces[first[v + 1] - 1].
struct FacesAround {
  std::vector<std::uint32_t> first, faces;

  explicit FacesAround(const geometry::TriangleMesh& mesh) : first(mesh.positions_O.size() + 1) {
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t v : triangle) ++first[v + 1];
    for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
    faces.resize(mesh.triangles.size() * 3);
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (const std::uint32_t v : mesh.triangles[t]) faces[next[v]++] = static_cast<std::uint32_t>(t);
  }
};

glm::vec3 unit_or_zero(const glm::vec3& v) {
  const float length = glm::length(v);
  return length > 0 ? v / length : glm::vec3(0);
}

// A surface of revolution about the line from foot along axis: rings of (distance along the axis, radius), each two
// neighbours joined by a band whose normals are those of the profile.
void append_lathe(Solid& solid, const glm::dvec3& foot, const glm::dvec3& axis,
                  const std::vector<glm::dvec2>& profile) {
  const glm::dquat R = spatial::frame_with_z(axis);
  const auto at = [&](const glm::dvec2& ring, int side) {
    const double angle = 2 * std::numbers::pi * side / kSides;
    return foot + R * glm::dvec3(ring.y * std::cos(angle), ring.y * std::sin(angle), ring.x);
  };
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const glm::dvec2 a = profile[i], b = profile[i + 1], along = b - a;
    const glm::dvec2 slope = glm::normalize(glm::dvec2(-along.y, along.x));  // (along the axis, outwards)
    const auto normal = [&](int side) {
      const double angle = 2 * std::numbers::pi * side / kSides;
      return glm::vec3(R * glm::dvec3(slope.y * std::cos(angle), slope.y * std::sin(angle), slope.x));
    };
    for (int side = 0; side < kSides; ++side) {
      const Corner corners[4] = {{glm::vec3(at(a, side)), normal(side)},
                                 {glm::vec3(at(a, side + 1)), normal(side + 1)},
                                 {glm::vec3(at(b, side + 1)), normal(side + 1)},
                                 {glm::vec3(at(b, side)), normal(side)}};
      for (const int corner : {0, 1, 2, 0, 2, 3}) solid.push_back(corners[corner]);
    }
  }
}

}  // namespace

Solid solid_of(const geometry::TriangleMesh& mesh_O, const spatial::Pose& X_WO, const glm::dvec3& origin_W,
               std::span<const std::array<std::uint8_t, 3>> tints_sRGB) {
  const spatial::Pose X{X_WO.R, X_WO.p - origin_W};
  std::vector<glm::vec3> positions(mesh_O.positions_O.size());
  std::transform(mesh_O.positions_O.begin(), mesh_O.positions_O.end(), positions.begin(),
                 [&X](const glm::dvec3& p_O) { return glm::vec3(spatial::transform_point(X, p_O)); });

  std::vector<glm::vec3> areas(mesh_O.triangles.size());  // normal to the face, as long as twice its area
  std::vector<glm::vec3> units(mesh_O.triangles.size());
  for (std::size_t t = 0; t < areas.size(); ++t) {
    const auto& [a, b, c] = mesh_O.triangles[t];
    areas[t] = glm::cross(positions[b] - positions[a], positions[c] - positions[a]);
    units[t] = unit_or_zero(areas[t]);
  }

  const FacesAround around(mesh_O);
  Solid solid;
  solid.reserve(3 * mesh_O.triangles.size());
  for (std::size_t t = 0; t < mesh_O.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh_O.triangles[t]) {
      glm::vec3 sum = areas[t];
      for (std::uint32_t i = around.first[v]; i < around.first[v + 1]; ++i) {
        const std::uint32_t other = around.faces[i];
        if (other != t && glm::dot(units[other], units[t]) > kCosCrease) sum += areas[other];
      }
      Corner& corner = solid.emplace_back(Corner{positions[v], unit_or_zero(sum)});
      if (!tints_sRGB.empty()) corner.tint_sRGB = {tints_sRGB[v][0], tints_sRGB[v][1], tints_sRGB[v][2], 255};
    }
  }
  return solid;
}

void append_arrow(Solid& solid, const glm::dvec3& foot, const glm::dvec3& tip, double radius_m) {
  const double length = glm::length(tip - foot);
  if (!(length > 0)) return;
  const double head_length = std::min(6 * radius_m, 0.7 * length);
  const double head_radius = head_length * 0.42;
  const double shaft_radius = std::min(radius_m, 0.6 * head_radius);
  const double neck = length - head_length;
  append_lathe(solid, foot, (tip - foot) / length,
               {{0, 0}, {0, shaft_radius}, {neck, shaft_radius}, {neck, head_radius}, {length, 0}});
}

void append_ball(Solid& solid, const glm::dvec3& centre, double radius_m) {
  std::vector<glm::dvec2> profile;
  constexpr int kRings = 12;
  for (int ring = 0; ring <= kRings; ++ring) {
    const double angle = std::numbers::pi * ring / kRings;
    profile.emplace_back(-radius_m * std::cos(angle), radius_m * std::sin(angle));
  }
  append_lathe(solid, centre, {0, 0, 1}, profile);
}

}  // namespace farfeel::master_station
