// Pegs, threads, gears, edges and tips: closed solids, most of them no height field along any one direction.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "slave_sim/models/height_plate.h"
#include "tests/bench/hardcases_contact.h"
#include "tests/support/sheets.h"
#include "tests/support/solids.h"
#include "tests/support/textured_solids.h"

namespace farfeel::bench {
namespace {

using contact::ContactSet;
using spatial::Pose;
using namespace support;

double degrees_between(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 180 / std::numbers::pi;
}

constexpr double kPerceived_degrees = 25;  ///< hands tell force directions apart from 18 to 32 degrees on
const double kStiffness_N_per_m = contact::combined({}, {}).stiffness_N_per_m;

/// What the contacts of this answer can push the tool by along `back` [N], in closed form. A contact's gradient is
/// along -m, where m is the normal that the surface has where it touches, and along its direction n the surfaces
/// overlap there by overlap_m(n, m). The soft maximum adds w ln(A / a0), where A is no more than all the area that
/// overlaps. How many contacts share the surfaces does not matter: each is held to its place.
template <typename Overlap>
double most_push_N(const ContactSet& set, const glm::dvec3& back, Overlap&& overlap_m, double area_m2) {
  constexpr double kSoft_m = 10e-6;
  const double spread_m = kSoft_m * std::log(area_m2 / penetration::kReferenceArea_m2);
  double sum_N = 0;
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const contact::Contact& c = set.contacts[i];
    const glm::dvec3 g{c.gradient[3], c.gradient[4], c.gradient[5]};
    const double most_m = overlap_m(c.nhat_ST_W, -glm::normalize(g)) + spread_m;
    sum_N += c.material.stiffness_N_per_m * std::max(0.0, most_m) * std::max(0.0, -glm::dot(g, back));
  }
  return sum_N;
}

constexpr const char* kOfTheMost = "force, of the most that its contacts can push";
constexpr double kMostPercent = 110;  ///< m is a mean over what bends round: a tenth for that, as for the least force

// A peg of the hole's radius less the clearance, pushed aside until it sinks 0.2 mm into the wall.
void peg_in_hole(HardCaseRows& rows) {
  constexpr double kHole_m = 0.010, kHigh_m = 0.020, kSunk_m = 0.2e-3;
  constexpr std::uint32_t kSides = 48;
  for (const double clearance_m : {1e-3, 0.3e-3, 0.1e-3, 0.02e-3, 0.0}) {
    const Touching pair{.s = untextured(tube_mesh(kHole_m, 0.016, kHigh_m, kSides)),
                        .t = untextured(cylinder_mesh(kHole_m - clearance_m, 0.030, kSides)),
                        .tolerance_m = 2e-3,
                        .X_WO = {}};
    const double gap_m = clearance_m * std::cos(std::numbers::pi / kSides),
                 area_m2 = 2 * std::acos(clearance_m / (clearance_m + kSunk_m)) * kHole_m * kHigh_m;
    double worst_degrees = 0, least = 1e9, most = 0;
    bool is_fine = true;
    for (int way = 0; way < 16; ++way) {
      const double angle = (way + 0.3) * std::numbers::pi / 8;
      const glm::dvec3 aside{std::cos(angle), std::sin(angle), 0};
      const ContactSet set = pair.answer({{1, 0, 0, 0}, (clearance_m + kSunk_m) * aside});
      is_fine = is_fine && is_finite(set) && set.count > 0;
      worst_degrees = std::max(worst_degrees, degrees_between(set.F_To_W.force_N, -aside));
      const double share = glm::length(set.F_To_W.force_N) / (kStiffness_N_per_m * kSunk_m);
      least = std::min(least, share);
      const auto overlap_m = [&](const glm::dvec3& n, const glm::dvec3& m) {
        return (-(clearance_m + kSunk_m) * glm::dot(aside, m) - gap_m) / glm::dot(n, m);
      };
      const double most_N = most_push_N(set, -aside, overlap_m, area_m2);
      most = std::max(most, -glm::dot(set.F_To_W.force_N, aside) / most_N);
    }
    const ContactSet centred = pair.answer({});
    const std::string name = fmt::format("peg in hole, clearance {:.2f} mm", 1e3 * clearance_m);
    rows.push_back({name, "answers that are no number", is_fine && is_finite(centred) ? 0.0 : 1.0, "", 0});
    rows.push_back({name, "force off the way to the centre", worst_degrees, "deg", kPerceived_degrees});
    rows.push_back({name, "force less than one spring's by", 100 * (1 - least), "%", 10});
    rows.push_back({name, kOfTheMost, 100 * most, "%", kMostPercent});
    rows.push_back({name, "force when centred", glm::length(centred.F_To_W.force_N), "N", 0.15});
  }
}

// A nut displaced along and across its bolt by 0.2 mm more than its play.
void nut_on_bolt(HardCaseRows& rows) {
  const Thread thread;
  constexpr double kClearance_m = 0.1e-3, kSunk_m = 0.2e-3;
  constexpr std::uint32_t kNutTurns = 2;
  const Touching pair{.s = untextured(bolt_mesh(thread)),
                      .t = untextured(nut_mesh(thread, kClearance_m, kNutTurns)),
                      .tolerance_m = 1e-3,
                      .X_WO = {}};
  const double flank = 2 * thread.depth_m / thread.pitch_m;  // dr / dz
  const double area_m2 = kNutTurns * 2 * std::numbers::pi * (thread.radius_m + thread.depth_m) * thread.pitch_m *
                         std::hypot(1, flank);  // of both flanks
  const ContactSet rest = pair.answer({});
  rows.push_back(
      // Flanks 0.08 mm apart: the soft maximum adds w ln(area / a0) = 0.07 mm, so that they nearly touch.
      {"nut on bolt, at rest", "force", is_finite(rest) ? glm::length(rest.F_To_W.force_N) : std::nan(""), "N", 0.05});
  const auto judge = [&](const std::string& name, const glm::dvec3& way, double play_m, double slope) {
    const ContactSet set = pair.answer({{1, 0, 0, 0}, (play_m + kSunk_m) * way});
    rows.push_back({name, "force off the way back",
                    is_finite(set) ? degrees_between(set.F_To_W.force_N, -way) : std::nan(""), "deg",
                    kPerceived_degrees});
    // One flank's spring pushes along its own normal: of its force, and of the depth, the slope's share counts.
    const double one_N = kStiffness_N_per_m * kSunk_m * slope * slope;
    const double springs = -glm::dot(set.F_To_W.force_N, way) / one_N;
    rows.push_back({name, "force less than one flank's by", 100 * (1 - springs), "%", 10});
    // m may be the mean of both flanks, which meet at a crest: the deeper one counts.
    const auto overlap_m = [&](const glm::dvec3& n, const glm::dvec3& m) {
      double deeper_m = -1;
      for (const double side : {1.0, -1.0}) {
        const glm::dvec3 of_flank =
            glm::normalize(glm::normalize(glm::dvec3(m.x, m.y, 0)) + glm::dvec3(0, 0, side * flank));
        const double nearer_m = -(play_m + kSunk_m) * glm::dot(way, of_flank) - kClearance_m / std::hypot(1, flank);
        deeper_m = std::max(deeper_m, nearer_m / glm::dot(n, of_flank));
      }
      return deeper_m;
    };
    const double most_N = most_push_N(set, -way, overlap_m, area_m2);
    rows.push_back({name, kOfTheMost, -100 * glm::dot(set.F_To_W.force_N, way) / most_N, "%", kMostPercent});
  };
  for (const double side : {1.0, -1.0}) {
    judge(fmt::format("nut on bolt, {} along the axis", side > 0 ? "up" : "down"), {0, 0, side}, kClearance_m / flank,
          flank / std::hypot(1, flank));
  }
  for (int way = 0; way < 4; ++way) {
    const double angle = 0.2 + way * std::numbers::pi / 2;
    judge(fmt::format("nut on bolt, aside, way {}", way), {std::cos(angle), std::sin(angle), 0}, kClearance_m,
          1 / std::hypot(1, flank));
  }
}

// A peg and a thread that carry relief themselves, against dense points of the displaced surfaces.
void textured_peg_in_hole(HardCaseRows& rows) {
  const auto ridges = [](const glm::dvec3& p) { return 0.05e-3 * (std::cos(2 * std::numbers::pi * p.z / 1e-3) - 1); };
  const Touching pair{.s = textured(tube_mesh(0.010, 0.016, 0.010, 24), ridges),
                      .t = textured(cylinder_mesh(0.0099, 0.008, 24), ridges),
                      .tolerance_m = 2e-3,
                      .X_WO = {}};
  const auto pressed_there = [](const glm::dvec3& p) { return p.x > 0.009 && std::hypot(p.x, p.y) < 0.0102; };
  const auto dense_s = dense_points(pair.s, 0.06e-3, pressed_there),
             dense_t = dense_points(pair.t, 0.06e-3, pressed_there);
  double off_m = 0, worst_degrees = 0;
  for (const double along_m : {0.0, 0.25e-3, 0.5e-3}) {  // crest on crest, flank on flank, crest on valley
    const Pose X_OT{{1, 0, 0, 0}, {0.3e-3, 0.03e-3, along_m}};
    const ContactSet set = pair.answer(X_OT);
    const DenseDepth truth = dense_depth(dense_s, dense_t, X_OT, 0.5e-3, 10e-6, 1e-7);
    off_m = std::max(off_m, std::abs(deepest_of(set).depth_m - truth.soft_depth_m));
    const glm::dvec3 across{set.F_To_W.force_N.x, set.F_To_W.force_N.y, 0};
    worst_degrees = std::max(worst_degrees, degrees_between(across, {-0.3e-3, -0.03e-3, 0}));
  }
  rows.push_back({"textured peg in hole", "depth against dense points", 1e6 * off_m, "um", 10});
  rows.push_back({"textured peg in hole", "force off the way to the centre", worst_degrees, "deg", kPerceived_degrees});
}

// Flanks as steep as a metric thread's lie above each other along the axis: height fields take one flight for another.
void textured_nut_on_bolt(HardCaseRows& rows) {
  const Thread thread{.radius_m = 4e-3, .depth_m = 1.3e-3, .pitch_m = 1.5e-3, .turns = 1, .sides = 16, .steps = 4};
  const auto ridges = [](const glm::dvec3& p) {
    return 0.02e-3 * (std::cos(2 * std::numbers::pi * std::hypot(p.x, p.y) / 0.5e-3) - 1);
  };
  constexpr double kClearance_m = 0.1e-3;
  const Touching pair{.s = textured(bolt_mesh(thread), ridges),
                      .t = textured(nut_mesh(thread, kClearance_m, 3), ridges),
                      .tolerance_m = 0.5e-3,
                      .X_WO = {}};
  const double slope = 2 * thread.depth_m / thread.pitch_m;
  const auto near_the_thread = [&](const glm::dvec3& p) {
    return std::hypot(p.x, p.y) < thread.radius_m + thread.depth_m + kClearance_m;
  };
  const auto dense_s = dense_points(pair.s, 0.1e-3, near_the_thread),
             dense_t = dense_points(pair.t, 0.1e-3, near_the_thread);
  for (const double sunk_m : {0.1e-3, 0.2e-3}) {
    const Pose X_OT{{1, 0, 0, 0}, {0, 0, (kClearance_m + sunk_m * std::hypot(1, slope)) / slope}};
    contact_service::ContactService service = pair.service();
    const contact_service::Answer set = service.answer(pose_number(0, X_OT));
    const DenseDepth truth = dense_depth(dense_s, dense_t, X_OT, 0.4e-3, 10e-6, 1e-7);
    const std::string name = fmt::format("textured nut on bolt, steep, sunk {:.1f} mm", 1e3 * sunk_m);
    rows.push_back({name, "answers that are no number, or no points",
                    is_finite(set) && set.times.point_contacts > 0 ? 0.0 : 1.0, "", 0});
    rows.push_back(
        {name, "deepest against dense points", 1e6 * std::abs(deepest_of(set).depth_m - truth.soft_depth_m), "um", 40});
    rows.push_back(
        {name, "force off the way back", degrees_between(set.F_To_W.force_N, {0, 0, -1}), "deg", kPerceived_degrees});
    rows.push_back({name, "time of an answer", 1e-3 * set.times.total_us, "ms", 1e3});
  }
}

// Two spur gears at the distance where flanks have play; one is turned until its teeth press either flank.
void gear_interlock(HardCaseRows& rows) {
  constexpr std::uint32_t kTeeth = 24;
  constexpr double kRadius_m = 0.020, kTooth_m = 3e-3, kPlay_m = 0.4e-3;
  const Touching pair{.s = untextured(spur_mesh(kTeeth, kRadius_m, kTooth_m, 0.010)),
                      .t = untextured(spur_mesh(kTeeth, kRadius_m, kTooth_m, 0.008)),
                      .tolerance_m = 1e-3,
                      .X_WO = {}};
  const double apart_m = 2 * kRadius_m + kTooth_m + kPlay_m, tooth = 2 * std::numbers::pi / kTeeth;
  // A crest of S points at T; T turned by half a turn shows a crest to S: half a tooth on, its valley.
  const auto meshed = [&](double turn) {
    return Pose{spatial::rotation_from_vector({0, 0, std::numbers::pi + 0.5 * tooth + turn}), {apart_m, 0, 0}};
  };
  const ContactSet rest = pair.answer(meshed(0));
  rows.push_back({"gears in mesh, at rest", "force", is_finite(rest) ? glm::length(rest.F_To_W.force_N) : std::nan(""),
                  "N", 0.02});
  double torque[2] = {0, 0};
  for (const int side : {0, 1}) {
    const double turn = (side == 0 ? 1 : -1) * 0.03;
    const ContactSet set = pair.answer(meshed(turn)), truth = pair.answer(meshed(turn), kTruthMaker, 200);
    torque[side] = set.F_To_W.torque_Nm.z;
    const std::string name = fmt::format("gears in mesh, turned {:+.2f} rad", turn);
    rows.push_back(
        {name, "torque that does not oppose the turn", is_finite(set) && torque[side] * turn < 0 ? 0.0 : 1.0, "", 0});
    rows.push_back({name, "wrench against truth", 100 * wrench_error(set.F_To_W, truth.F_To_W), "%", 15});
  }
  rows.push_back({"gears in mesh, both ways", "torques' difference",
                  100 * std::abs(torque[0] + torque[1]) / std::abs(torque[0]), "%", 5});
}

void needle_tip(HardCaseRows& rows) {
  for (const double half_angle : {0.6, 0.3, 0.1}) {
    const Touching pair{
        .s = slave_sim::height_plate([](double, double) { return 0.0; }, {.size_m = {0.024, 0.020, 0.004}}),
        .t = untextured(cone_mesh(half_angle, 0.010, 24)),
        .tolerance_m = 2e-3,
        .X_WO = {}};
    contact_service::ContactService service = pair.service();
    double worst_m = 0, worst_degrees = 0;
    bool is_fine = true;
    for (std::uint32_t i = 0; i < 20; ++i) {  // pressed, upright and leaning
      const double lean = 0.02 * i;
      const ContactSet& set =
          service.answer(pose_number(i, {spatial::rotation_from_vector({0, lean, 0}), {1e-4 * i, 0, -0.2e-3}}));
      is_fine = is_fine && is_finite(set) && set.count == 1;
      worst_m = std::max(worst_m, std::abs(deepest_of(set).depth_m - 0.2e-3));
      worst_degrees = std::max(worst_degrees, degrees_between(set.F_To_W.force_N, {0, 0, 1}));
    }
    const std::string name = fmt::format("needle tip, half angle {:.0f} degrees", half_angle * 180 / std::numbers::pi);
    rows.push_back({name, "answers that are no number, or no contact", is_fine ? 0.0 : 1.0, "", 0});
    // A tip much narrower than a0's circle of 0.36 mm is felt later, by what the soft maximum loses: 10 widths at most.
    rows.push_back({name, "depth against the closed form", 1e6 * worst_m, "um", 101});
    rows.push_back({name, "force off the plate's normal", worst_degrees, "deg", 5});
  }
}

// A box's edge slides over the table's, in steps of 10 um, until it falls off. The way out turns from up to
// sideways there, 0.2 N each.
void grazing_edge(HardCaseRows& rows) {
  const Touching pair{.s = untextured(box_mesh({0.020, 0.020, 0.010})),
                      .t = untextured(box_mesh({0.010, 0.010, 0.010})),
                      .tolerance_m = 2e-3,
                      .X_WO = {}};
  contact_service::ContactService service = pair.service();
  double largest_step_J = 0, before_J = 0;
  bool is_fine = true;
  for (std::uint32_t i = 0; i < 120; ++i) {
    const double over_m = (60.0 - i) * 10e-6 + 3e-6;  // what of the tool still stands on the table
    const ContactSet& set = service.answer(pose_number(i, {{1, 0, 0, 0}, {0.015 - over_m, 0, 0.010 - 0.2e-3}}));
    double energy_J = 0;
    for (std::uint32_t k = 0; k < set.count; ++k) {
      const contact::Contact& c = set.contacts[k];
      energy_J += 0.5 * c.material.stiffness_N_per_m * std::pow(std::max(c.depth_m, 0.0), 2);
    }
    if (i > 0) largest_step_J = std::max(largest_step_J, std::abs(energy_J - before_J));
    before_J = energy_J;
    is_fine = is_fine && is_finite(set);
  }
  rows.push_back({"grazing edge slides off, 10 mm/s", "answers that are no number", is_fine ? 0.0 : 1.0, "", 0});
  rows.push_back({"grazing edge slides off, 10 mm/s", "largest step of energy", 1e6 * largest_step_J, "uJ", 6});
}

// A plate in a slot 0.1 mm narrower on either side: the walls' forces cancel, and centre it.
void opposed_walls(HardCaseRows& rows) {
  const auto wall = [](double x_m) { return glm::dvec3{x_m, 0, 0}; };
  geometry::TriangleMesh slot = box_mesh({0.010, 0.020, 0.020}), other = slot;
  for (glm::dvec3& p : slot.positions_O) p -= wall(0.010);
  for (const glm::dvec3& p : other.positions_O) slot.positions_O.push_back(p + wall(0.010));
  for (geometry::Triangle t : other.triangles) {
    for (std::uint32_t& v : t) v += static_cast<std::uint32_t>(other.positions_O.size());
    slot.triangles.push_back(t);
  }
  const Touching pair{
      .s = untextured(slot), .t = untextured(box_mesh({0.0102, 0.010, 0.010})), .tolerance_m = 2e-3, .X_WO = {}};
  const ContactSet middle = pair.answer({}), aside = pair.answer({{1, 0, 0, 0}, {0.05e-3, 0, 0}});
  rows.push_back({"opposed walls", "contacts found less two",
                  is_finite(middle) ? std::abs(middle.count - 2.0) : std::nan(""), "", 0});
  rows.push_back({"opposed walls", "force in the middle", glm::length(middle.F_To_W.force_N), "N", 1e-3});
  rows.push_back({"opposed walls, 0.05 mm aside", "force off the way back",
                  degrees_between(aside.F_To_W.force_N, {-1, 0, 0}), "deg", 1});
}

/// A box of flat faces comes down on another at 10 mm/s, turned off its axes, and is pressed into it: each face is one
/// flat piece, which the other has passed through from the first micrometre on. The lower one's overlap is the same all
/// over the upper one's bottom, so the soft maximum is that and w ln(A / a0).
void flat_faces(HardCaseRows& rows) {
  constexpr double kStep_m = 10e-6, kSoft_m = 10e-6;
  constexpr glm::dvec3 kLower_m{0.06, 0.05, 0.03}, kUpper_m{0.03, 0.02, 0.02};
  const Touching pair{.s = box_of_sheets(kLower_m), .t = box_of_sheets(kUpper_m), .X_WO = {}};
  contact_service::ContactService service = pair.service();
  const double area_m2 = kUpper_m.x * kUpper_m.y, touch_m = 0.5 * (kLower_m.z + kUpper_m.z),
               spread_m = kSoft_m * std::log(area_m2 / penetration::kReferenceArea_m2);
  double off_m = 0, least_share = 1e9;
  for (std::uint32_t i = 0; i < 130; ++i) {
    const double deep_m = kStep_m * (static_cast<double>(i) - 30);
    const ContactSet& set =
        service.answer(pose_number(i, {spatial::rotation_from_vector({0, 0, 0.3}), {2e-3, 1e-3, touch_m - deep_m}}));
    if (!(deep_m > 0.2e-3)) continue;
    const double felt_m = deep_m + spread_m;
    const double now_m = std::abs(deepest_of(set).depth_m - felt_m);  // no number where there is no contact
    if (!(now_m <= off_m)) off_m = now_m;
    least_share = std::min(least_share, set.F_To_W.force_N.z / (kStiffness_N_per_m * felt_m));
  }
  rows.push_back({"box on box of flat faces, pressed", "depth off the closed form", 1e6 * off_m, "um", 50});
  rows.push_back(
      {"box on box of flat faces, pressed", "force less than one spring's by", 100 * (1 - least_share), "%", 10});
}

}  // namespace

std::span<const HardCase> solid_cases() {
  static constexpr HardCase kCases[] = {
      {"flat faces, pressed", flat_faces},
      {"peg in hole", peg_in_hole},
      {"opposed walls", opposed_walls},
      {"grazing edge", grazing_edge},
      {"needle tip", needle_tip},
      {"gears in mesh", gear_interlock},
      {"nut on bolt", nut_on_bolt},
      {"textured peg in hole", textured_peg_in_hole},
      {"textured nut on bolt", textured_nut_on_bolt},
  };
  return kCases;
}

}  // namespace farfeel::bench
