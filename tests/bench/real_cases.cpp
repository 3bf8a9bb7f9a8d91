#include "tests/bench/real_cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "slave_sim/models/height_plate.h"
#include "tests/support/solids.h"

namespace farfeel::bench {
namespace {

using namespace support;
using spatial::Pose;

Pose moved_by(const Pose& X, const glm::dvec3& by) {
  return {X.R, X.p + by};
}

Pose turned_by(const Pose& X, const glm::dvec3& v_rad) {
  return {glm::normalize(spatial::rotation_from_vector(v_rad) * X.R), X.p};
}

double wave(double s, double cycles) {
  return s < 1 ? std::sin(2 * std::numbers::pi * cycles * s) : 0;
}

RealCase peg_in_hole(double clearance_m) {
  RealCase c;
  c.pair = std::make_unique<FeltPair>(fmt::format("peg in hole, clearance {:.2f} mm", 1e3 * clearance_m),
                                      untextured(tube_mesh(0.010, 0.016, 0.020, 48)),
                                      untextured(cylinder_mesh(0.010 - clearance_m, 0.030, 48)), 2e-3);
  c.X_wanted = [](double s) {
    return turned_by({{1, 0, 0, 0}, {0, 0, 0.002 * wave(s, 2)}}, {0.02 * wave(s, 3), 0.02 * wave(s, 1), 0});
  };
  c.push_W = {0.8, 0.6, 0};
  return c;
}

RealCase nut_on_bolt() {
  const Thread thread{.turns = 3, .sides = 16};
  RealCase c;
  c.pair = std::make_unique<FeltPair>("nut on bolt", untextured(bolt_mesh(thread)),
                                      untextured(nut_mesh(thread, 0.1e-3, 1)), 1e-3);
  c.X_wanted = [](double s) {  // pulled up and down, turned with the thread a little
    return turned_by({{1, 0, 0, 0}, {0, 0, 0.4e-3 * wave(s, 3)}}, {0, 0, 0.2 * wave(s, 1)});
  };
  c.push_W = {0, 0, 1};
  return c;
}

RealCase gear_interlock() {
  constexpr std::uint32_t kTeeth = 24;
  constexpr double kRadius_m = 0.020, kTooth_m = 3e-3, kPlay_m = 0.4e-3, kHalfTooth = std::numbers::pi / kTeeth;
  RealCase c;
  c.pair = std::make_unique<FeltPair>("gear interlock", untextured(spur_mesh(kTeeth, kRadius_m, kTooth_m, 0.010)),
                                      untextured(spur_mesh(kTeeth, kRadius_m, kTooth_m, 0.008)), 1e-3);
  c.X_start = {spatial::rotation_from_vector({0, 0, std::numbers::pi + kHalfTooth}),
               {2 * kRadius_m + kTooth_m + kPlay_m, 0, 0}};
  c.X_wanted = [start = c.X_start](double s) { return turned_by(start, {0, 0, 0.15 * wave(s, 2)}); };
  c.push_W = {-1, 0, 0};  // into the mesh
  return c;
}

RealCase opposed_walls() {
  geometry::TriangleMesh slot = box_mesh({0.010, 0.020, 0.020});
  const geometry::TriangleMesh one = slot;
  for (glm::dvec3& p : slot.positions_O) p.x -= 0.010;
  for (const glm::dvec3& p : one.positions_O) slot.positions_O.push_back(p + glm::dvec3(0.010, 0, 0));
  for (geometry::Triangle t : one.triangles) {
    for (std::uint32_t& v : t) v += static_cast<std::uint32_t>(one.positions_O.size());
    slot.triangles.push_back(t);
  }
  RealCase c;  // the plate is 0.2 mm too thick for its slot
  c.pair =
      std::make_unique<FeltPair>("opposed walls", untextured(slot), untextured(box_mesh({0.0102, 0.010, 0.010})), 2e-3);
  c.X_start.p.z = 0.018;  // above the slot
  c.X_wanted = [](double s) { return Pose{{1, 0, 0, 0}, {0.5e-3 * wave(s, 4), 0, 0.018 * std::max(0.0, 1 - 3 * s)}}; };
  c.push_W = {1, 0, 0};
  return c;
}

RealCase grazing_edge() {
  RealCase c;
  c.pair = std::make_unique<FeltPair>("grazing edge", untextured(box_mesh({0.020, 0.020, 0.010})),
                                      untextured(box_mesh({0.010, 0.010, 0.010})), 2e-3);
  c.X_start.p = {0, 0, 0.011};
  c.X_wanted = [](double s) {  // out over the edge, where the box drops off, and back on from above
    const double out = std::sin(std::numbers::pi * std::min(1.0, s));
    return Pose{{1, 0, 0, 0}, {0.0155 * out, 0, 0.010 - 0.002 * (1 - out * out) - 0.0005}};
  };
  c.push_W = {0, 0, -1};
  // The push takes the tool down beside the table. What yields lets it up again; 5 N/mm and more hold it there.
  c.hooked_m = 0.015;
  return c;
}

RealCase needle_on(std::string name, geometry::HapticSurface table) {
  RealCase c;
  c.pair = std::make_unique<FeltPair>(std::move(name), std::move(table), untextured(cone_mesh(0.3, 0.010, 24)), 2e-3);
  c.X_start.p.z = 1e-3;
  c.X_wanted = [](double s) {
    return turned_by({{1, 0, 0, 0}, {0.006 * wave(s, 2), 0.002 * wave(s, 1), -0.5e-3 * std::min(1.0, 4 * s)}},
                     {0, 0.2 * wave(s, 1), 0});
  };
  c.push_W = {0, 0, -1};
  return c;
}

RealCase plate_on_plate(std::string name, geometry::HapticSurface table, geometry::HapticSurface tool) {
  RealCase c;
  c.pair = std::make_unique<FeltPair>(std::move(name), std::move(table), std::move(tool));
  c.X_start = {{0, 1, 0, 0}, {0, 0, 1e-3}};
  c.X_wanted = [start = c.X_start](double s) {
    return turned_by(moved_by(start, {0.004 * wave(s, 2), 0, -1.5e-3 * std::min(1.0, 4 * s)}),
                     {0, 0, 0.05 * wave(s, 1)});
  };
  c.push_W = {0, 0, -1};
  return c;
}

}  // namespace

std::vector<RealCase> real_cases() {
  const slave_sim::PlateSize table{.size_m = {0.024, 0.020, 0.004}}, tool{.size_m = {0.008, 0.006, 0.004}};
  const auto flat = [](double, double) { return 0.0; };
  std::vector<RealCase> all;
  for (const double clearance_m : {0.3e-3, 0.1e-3, 0.02e-3}) all.push_back(peg_in_hole(clearance_m));
  all.push_back(gear_interlock());
  all.push_back(nut_on_bolt());
  all.push_back(opposed_walls());
  all.push_back(grazing_edge());
  all.push_back(needle_on("needle on a flat plate", slave_sim::height_plate(flat, table)));
  all.push_back(needle_on("needle on ridges of 2 mm", slave_sim::ridged_plate(2e-3, 0.2e-3, table)));
  all.push_back(
      plate_on_plate("flat on flat", slave_sim::height_plate(flat, table), slave_sim::height_plate(flat, tool)));
  all.push_back(plate_on_plate("ridges in ridges, 2 mm", slave_sim::ridged_plate(2e-3, 0.3e-3, table),
                               slave_sim::ridged_plate(2e-3, 0.3e-3, tool)));
  return all;
}

}  // namespace farfeel::bench
