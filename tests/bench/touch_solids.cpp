// The generated solids. Profiles of surfaces of revolution run counter-clockwise in the (r, z) half plane; plates are
// lattices whose points are moved by a closed form.
#include "tests/bench/touch_solids.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "slave_sim/models/lattice_solid.h"
#include "slave_sim/models/models.h"
#include "tests/bench/touch_models.h"
#include "tests/support/solids.h"

namespace farfeel::bench {
namespace {

using geometry::TriangleMesh;
using slave_sim::LatticePoint;
using slave_sim::LatticeSolid;
using support::ProfilePoint;

constexpr std::uint32_t kSides = 96;
constexpr double kPi = std::numbers::pi, kmm = 1e-3;
constexpr double kPole_rad = 0.01;  // of a profile's first and last point from the axis: a flat fan closes it

/// Points of an arc about (0, z) from one polar angle to another, measured from -z, both ends included.
void add_arc(std::vector<ProfilePoint>& profile, double radius_m, double z_m, double from_rad, double to_rad, int n) {
  for (int i = 0; i <= n; ++i) {
    const double angle = from_rad + (to_rad - from_rad) * i / n;
    profile.push_back({radius_m * std::sin(angle), z_m - radius_m * std::cos(angle)});
  }
}

/// A straight part to the given point, without the profile's last point, in n steps.
void add_line(std::vector<ProfilePoint>& profile, const ProfilePoint& to, int n) {
  const ProfilePoint from = profile.back();
  for (int i = 1; i <= n; ++i) {
    const double s = static_cast<double>(i) / n;
    profile.push_back({from.r_m + s * (to.r_m - from.r_m), from.z_m + s * (to.z_m - from.z_m)});
  }
}

TriangleMesh turned(const std::vector<ProfilePoint>& profile, bool is_ring = false, std::uint32_t sides = kSides) {
  return support::turned_mesh({sides, static_cast<std::uint32_t>(profile.size()), is_ring,
                               [&profile](std::uint32_t row, double) { return profile[row]; }});
}

/// Part of a hollow sphere up to a polar angle, its pole at the bottom.
TriangleMesh spherical_shell(double radius_m, double wall_m, double half_angle_rad) {
  std::vector<ProfilePoint> profile;
  const int rows = static_cast<int>(std::ceil(half_angle_rad * radius_m / (2 * kmm)));
  add_arc(profile, radius_m, 0, kPole_rad, half_angle_rad, rows);
  add_arc(profile, radius_m - wall_m, 0, half_angle_rad, kPole_rad, rows);
  return turned(profile);
}

/// One box of the lattice, with steps of about step_m in x and y.
LatticeSolid plate(const glm::dvec3& size_m, double step_m, std::uint32_t z_steps = 1) {
  const auto steps = [&](double length_m) { return static_cast<std::uint32_t>(std::lround(length_m / step_m)); };
  const glm::dvec3 half = 0.5 * size_m;
  return {{{{-half.x, half.x}, {-half.y, half.y}, {-half.z, half.z}}},
          {{{steps(size_m.x)}, {steps(size_m.y)}, {z_steps}}},
          [](int, int, int) { return true; }};
}

/// A plate whose upper face is raised by height_m(x, y).
template <typename Height>
TriangleMesh relief_plate(const glm::dvec3& size_m, double step_m, Height&& height_m) {
  return slave_sim::skin(plate(size_m, step_m, 4), [&](const LatticePoint& point) {
    glm::dvec3 p = point.p;
    if (p.z > 0.499 * size_m.z) p.z += height_m(p.x, p.y);
    return p;
  });
}

double triangle_wave(double phase) {  // 0 at whole numbers, 1 half way
  const double f = phase - std::floor(phase);
  return 1 - std::abs(2 * f - 1);
}

std::vector<double> scaled(std::vector<double> values, double by) {
  for (double& v : values) v *= by;
  return values;
}

}  // namespace

TriangleMesh bowl_mesh(double wall_mm) {
  return spherical_shell(60 * kmm, wall_mm * kmm, kPi / 2);
}

TriangleMesh dish_mesh(double wall_mm) {
  return spherical_shell(120 * kmm, wall_mm * kmm, 0.7);
}

TriangleMesh cup_mesh(double wall_mm) {
  constexpr double kRadius = 35 * kmm, kHeight = 70 * kmm;
  const double wall = wall_mm * kmm, inner = kRadius - wall;
  std::vector<ProfilePoint> profile{{1 * kmm, 0}};
  add_line(profile, {kRadius, 0}, 15);
  add_line(profile, {kRadius, kHeight}, 30);
  add_line(profile, {inner, kHeight}, 1);
  add_line(profile, {inner, wall}, 30);
  add_line(profile, {1 * kmm, wall}, 15);
  return turned(profile);
}

TriangleMesh lens_mesh(double thickness_mm) {
  const double half_m = 30 * kmm, sagitta = 0.5 * thickness_mm * kmm;
  const double radius = (half_m * half_m + sagitta * sagitta) / (2 * sagitta), angle = std::asin(half_m / radius);
  std::vector<ProfilePoint> profile;
  add_arc(profile, radius, radius - sagitta, kPole_rad, angle, 24);
  profile.pop_back();
  add_arc(profile, radius, sagitta - radius, kPi - angle, kPi - kPole_rad, 24);
  return turned(profile);
}

TriangleMesh tray_mesh(double wall_mm) {
  const double w = wall_mm * kmm, x = 60 * kmm, y = 40 * kmm, z = 20 * kmm;
  const LatticeSolid solid{{{{-x, w - x, x - w, x}, {-y, w - y, y - w, y}, {0, w, z}}},
                           {{{2, 57, 2}, {2, 37, 2}, {2, 9}}},
                           [](int i, int j, int k) { return i != 1 || j != 1 || k == 0; }};
  return slave_sim::skin(solid, [](const LatticePoint& point) { return point.p; });
}

TriangleMesh tube_mesh(double wall_mm) {
  constexpr double kOuter = 10 * kmm, kLength = 60 * kmm;
  const double inner = kOuter - wall_mm * kmm;
  std::vector<ProfilePoint> profile{{kOuter, 0}};
  add_line(profile, {kOuter, kLength}, 30);
  add_line(profile, {inner, kLength}, 1);
  add_line(profile, {inner, 0}, 30);
  return turned(profile, true);
}

TriangleMesh fins_mesh(double wall_mm) {
  constexpr int kFins = 8;
  constexpr double kGap = 4.5 * kmm, kBase = 5 * kmm, kHeight = 15 * kmm;
  LatticeSolid solid;
  double x = 0;
  for (int i = 0; i < 2 * kFins - 1; ++i) {
    solid.cuts_m[0].push_back(x);
    solid.steps[0].push_back(i % 2 == 0 ? 2 : 4);
    x += i % 2 == 0 ? wall_mm * kmm : kGap;
  }
  solid.cuts_m[0].push_back(x);
  solid.cuts_m[1] = {-20 * kmm, 20 * kmm}, solid.steps[1] = {40};
  solid.cuts_m[2] = {0, kBase, kBase + kHeight}, solid.steps[2] = {3, 15};
  solid.is_solid = [](int i, int, int k) { return k == 0 || i % 2 == 0; };
  return slave_sim::skin(solid, [](const LatticePoint& point) { return point.p; });
}

TriangleMesh bolt_solid(double pitch_mm) {
  return support::bolt_mesh({10 * kmm, 1.5 * kmm, pitch_mm * kmm, 6, kSides, 16});
}

TriangleMesh nut_solid(double pitch_mm) {
  return support::nut_mesh({10 * kmm, 1.5 * kmm, pitch_mm * kmm, 6, kSides, 16}, 0.1 * kmm, 4);
}

TriangleMesh knurl_mesh(double pitch_mm) {
  constexpr double kRadius = 15 * kmm, kLength = 40 * kmm, kHigh = 0.3 * kmm;
  const double around = std::round(2 * kPi * kRadius / (pitch_mm * kmm));
  const auto sides = static_cast<std::uint32_t>(8 * around);
  const std::uint32_t rows = 161;
  return support::turned_mesh({sides, rows, false, [=](std::uint32_t row, double theta) {
                                 const double z = kLength * row / (rows - 1), u = theta / (2 * kPi) * around,
                                              v = z / (pitch_mm * kmm);
                                 const double high = 0.5 * kHigh * (triangle_wave(u + v) + triangle_wave(u - v));
                                 return ProfilePoint{kRadius + high, z};
                               }});
}

TriangleMesh saw_mesh(double pitch_mm) {
  const double pitch = pitch_mm * kmm, high = 0.2 * pitch;
  return relief_plate({40 * kmm, 30 * kmm, 6 * kmm}, pitch / 6, [=](double x, double) {
    const double phase = x / pitch + 1e-6;
    return high * (phase - std::floor(phase));
  });
}

TriangleMesh spikes_mesh(double high_mm) {
  constexpr double kPitch = 4 * kmm;
  return relief_plate({40 * kmm, 40 * kmm, 6 * kmm}, 0.25 * kmm, [=](double x, double y) {
    const double u = std::abs(x / kPitch - std::round(x / kPitch)), v = std::abs(y / kPitch - std::round(y / kPitch));
    return high_mm * kmm * std::max(0.0, 1 - std::hypot(u, v) / 0.3);
  });
}

TriangleMesh sponge_mesh(double strut_mm) {
  LatticeSolid solid;
  for (int axis = 0; axis < 3; ++axis) {
    solid.cuts_m[axis] = {};
    for (int i = 0; i <= 7; ++i) solid.cuts_m[axis].push_back(i);
    solid.cuts_m[axis] = scaled(solid.cuts_m[axis], strut_mm * kmm);
    solid.steps[axis].assign(7, 5);
  }
  solid.is_solid = [](int i, int j, int k) { return i % 2 + j % 2 + k % 2 <= 1; };
  return slave_sim::skin(solid, [strut_mm](const LatticePoint& point) {
    const glm::dvec3 q = point.p / (strut_mm * kmm);
    const glm::dvec3 wave{std::sin(1.3 * q.y + 0.7 * q.z), std::sin(1.1 * q.z + 0.9 * q.x),
                          std::sin(1.2 * q.x + 0.8 * q.y)};
    return point.p + 0.12 * strut_mm * kmm * wave;
  });
}

TriangleMesh leaf_mesh(double wall_mm) {
  return slave_sim::skin(plate({80 * kmm, 50 * kmm, wall_mm * kmm}, 1 * kmm), [](const LatticePoint& point) {
    constexpr double kBend = 60 * kmm, kWave = 2 * kmm, kLong = 25 * kmm;
    const double angle = point.p.x / kBend;
    const double wave = kWave * std::sin(2 * kPi * point.p.y / kLong + 1e3 * 0.05 * point.p.x);
    const double r = kBend + point.p.z + wave;
    return glm::dvec3{r * std::sin(angle), point.p.y, r * std::cos(angle) - kBend};
  });
}

TriangleMesh wall_mesh(double wall_mm) {
  const auto z_steps = static_cast<std::uint32_t>(std::max(1.0, std::round(wall_mm / 2)));
  return slave_sim::skin(plate({60 * kmm, 60 * kmm, wall_mm * kmm}, 2 * kmm, z_steps), [](const LatticePoint& point) {
    constexpr double kBend = 150 * kmm;
    const double angle = point.p.x / kBend, r = kBend + point.p.z;
    return glm::dvec3{r * std::sin(angle), point.p.y, r * std::cos(angle) - kBend};
  });
}

TriangleMesh ball_mesh(double diameter_mm) {
  TriangleMesh mesh = slave_sim::probe_mesh();  // of 6 mm
  for (glm::dvec3& p : mesh.positions_O) p *= diameter_mm / 6;
  return mesh;
}

TriangleMesh ball_base(double diameter_mm) {
  TriangleMesh mesh = slave_sim::probe_base();
  for (glm::dvec3& p : mesh.positions_O) p *= diameter_mm / 6;
  return mesh;
}

TriangleMesh capsule_mesh(double diameter_mm, double length_mm) {
  const double radius = 0.5 * diameter_mm * kmm, half = 0.5 * length_mm * kmm - radius;
  std::vector<ProfilePoint> profile;
  add_arc(profile, radius, -half, 0.05, kPi / 2, 12);
  add_line(profile, {radius, half}, 40);
  profile.pop_back();
  add_arc(profile, radius, half, kPi / 2, kPi - 0.05, 12);
  return turned(profile, false, 48);
}

}  // namespace farfeel::bench
