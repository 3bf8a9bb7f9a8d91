// What `farfeel-bench touch` asserts in every test run: verdicts on made-up answers, and a few models of the list,
// baked coarsely and pressed.
#include "tests/bench/touch_places.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/bench/touch_rims.h"
#include "tests/bench/touch_rows.h"
#include "tests/bench/touch_solids.h"

namespace farfeel::bench {
namespace {

constexpr double kmm = 1e-3, kAllowed_m = 0.1 * kmm;

Told told(double true_m, double told_m, const glm::dvec3& force_N, std::uint8_t doubts = 0) {
  Told t{.truth = {.main = {true_m, {0, 0, 1}}}, .force_N = force_N, .depth_m = told_m, .doubts = doubts};
  const double size_N = glm::length(force_N);
  t.angle_rad = size_N > kNoForce_N ? t.truth.angle_rad(force_N / size_N) : std::numeric_limits<double>::quiet_NaN();
  return t;
}

TEST(TouchVerdict, TellsEachKindApart) {
  const Verdict right = judge(told(1 * kmm, 1.05 * kmm, {0, 0, 1}), {}, kAllowed_m);
  EXPECT_TRUE(right.is_right && !right.missed && !right.is_false && !right.inward && !right.unflagged);

  EXPECT_TRUE(judge(told(0.2 * kmm, -0.1 * kmm, {0, 0, 0}), {}, kAllowed_m).missed);
  EXPECT_FALSE(judge(told(0.05 * kmm, -0.1 * kmm, {0, 0, 0}), {}, kAllowed_m).missed);  // within what it may be off by

  EXPECT_TRUE(judge(told(1 * kmm, 6 * kmm, {0, 0.1, -5}), {}, kAllowed_m).inward);
  EXPECT_FALSE(judge(told(1 * kmm, 1 * kmm, {0, 5, 0.1}), {}, kAllowed_m).inward);

  EXPECT_TRUE(judge(told(1 * kmm, 1.2 * kmm, {0, 0, 1}), {}, kAllowed_m).unflagged);
  EXPECT_FALSE(judge(told(1 * kmm, 1.2 * kmm, {0, 0, 1}, 2), {}, kAllowed_m).unflagged);
  EXPECT_FALSE(judge(told(0.3 * kmm, 0.38 * kmm, {0, 0, 1}), {}, kAllowed_m).unflagged);  // off by a quarter, below a

  EXPECT_TRUE(
      judge(told(0.3 * kmm, 0.3 * kmm, {0, 0, 0.3}), {told(-0.2 * kmm, 0.1 * kmm, {0, 0, 0.2})}, kAllowed_m).is_false);
  EXPECT_FALSE(
      judge(told(0.3 * kmm, 0.3 * kmm, {0, 0, 0.3}), {told(-0.09 * kmm, 0.1 * kmm, {0, 0, 0.2})}, kAllowed_m).is_false);
}

TEST(TouchRows, CountAndTakeQuantiles) {
  TouchRow row;
  for (int i = 0; i <= 100; ++i) {
    const Told t = told(1 * kmm, (1 + 1e-5 * i) * kmm, {0, 0, 1}, i == 0 ? 2 : 0);
    row.add(t, judge(t, {}, kAllowed_m));
  }
  EXPECT_EQ(row.places, 101u);
  EXPECT_NEAR(quantile(row.depth_errors_um, 0.5), 0.5, 0.02);
  EXPECT_NEAR(quantile(row.depth_errors_um, 0.99), 0.99, 0.02);
  EXPECT_NEAR(row.flagged_right(), 1.0 / 101, 1e-9);
}

BakedMesh coarsely_baked(const std::string& name) {
  const auto models = touch_models("");
  for (const TouchModel& model : models) {
    if (model.name != name) continue;
    TouchMesh given = touch_mesh(model).value();
    given.options.texture = 256;
    auto baked = slave_sim::bake_asset(name, given.mesh, given.options).value();
    BakedMesh made{.asset = std::move(baked.asset), .original_O = given.mesh};
    for (glm::dvec3& p : made.original_O.positions_O) p += made.asset.p_OM_O;
    made.p999_m = std::max(baked.report.full_to_felt.p999_m, baked.report.felt_to_full.p999_m);
    return made;
  }
  throw std::runtime_error("no model " + name);
}

std::unique_ptr<TouchTool> coarse_ball(double diameter_mm) {
  const auto mesh = ball_mesh(diameter_mm);
  slave_sim::BakeOptions options{.coarse_triangles = 320, .texture = 256};
  options.coarse = ball_base(diameter_mm);
  auto baked = slave_sim::bake_asset("ball", mesh, options).value();
  BakedMesh made{.asset = std::move(baked.asset), .original_O = mesh};
  return std::make_unique<TouchTool>("ball", RoundTool{0.5 * kmm * diameter_mm, 0}, std::move(made));
}

/// Of so many places on a model, each pressed to each depth.
TouchRow pressed(const std::string& model, const std::vector<double>& depths_m, std::uint32_t places) {
  const TouchSubject subject(coarsely_baked(model));
  const auto tool = coarse_ball(6);
  Presser presser(subject, *tool);
  TouchRow row;
  for (std::uint32_t i = 0; i < places; ++i) {
    const auto place = place_on(subject, *tool, 1, i);
    if (!place) continue;
    const Pressed answers = presser.press(*place, depths_m);
    for (const Told& at : answers.at) row.add(at, judge(at, answers.before, subject.allowed_m()));
  }
  return row;
}

TEST(TouchPlaces, AreTheSameFromTheSameSeedAndFree) {
  const TouchSubject subject(coarsely_baked("tray-3"));
  const auto tool = coarse_ball(6);
  for (std::uint32_t i = 0; i < 50; ++i) {
    const auto place = place_on(subject, *tool, 7, i), again = place_on(subject, *tool, 7, i);
    ASSERT_TRUE(place && again);
    EXPECT_EQ(place->p_touch_O, again->p_touch_O);
    for (const double way_m : {1.0, 0.5, 0.1}) {
      EXPECT_GT(subject.truth.clearance_m(tool->shape, place->round_pose(-way_m * place->free_way_m)), 0);
    }
    EXPECT_NEAR(subject.truth.touch(tool->shape, place->round_pose(0.3 * kmm)).main.depth_m, 0.3 * kmm, 0.1 * kmm);
  }
}

// Models that are felt rightly, a place of each kind at least: a thick wall, and a lens whose one hull is its material.
TEST(TouchPlaces, PushBackTheRightWay) {
  for (const char* model : {"wall-30", "lens-8"}) {
    const TouchRow row = pressed(model, {0.05 * kmm, 0.3 * kmm, 1 * kmm}, 150);
    EXPECT_GT(row.places, 400u) << model;
    EXPECT_EQ(row.missed, 0u) << model;
    EXPECT_EQ(row.inward, 0u) << model;
    EXPECT_LT(quantile(row.depth_errors_um, 0.5), 50) << model;
  }
}

TEST(TouchEdges, AreWhatStandsOutSharply) {
  const geometry::TriangleMesh tray = tray_mesh(3);  // 120 x 80 x 20 mm outside, 114 x 74 mm inside
  const FreeEdges edges(tray);
  double length_m = 0;
  for (const FreeEdge& edge : edges.edges()) {
    length_m += glm::length(edges.along_O(edge));
    EXPECT_NEAR(glm::dot(edge.nhat_left_O, edge.nhat_right_O), 0, 1e-9);
    EXPECT_GT(glm::dot(glm::cross(edge.nhat_left_O, edge.nhat_right_O), edges.along_O(edge)), 0);
  }
  EXPECT_NEAR(length_m, 1.256, 1e-9);  // two rims outside, one inside, four corners; what is inside below is none
}

TEST(TouchPassages, AreClearAllAlongAndTheSameFromTheSameSeed) {
  const TouchSubject subject(coarsely_baked("tray-3"));
  const FreeEdges edges(subject.baked.original_O);
  const auto ball = coarse_ball(6);
  int across = 0;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const auto passage = passage_on(subject, edges, *ball, 0.2 * kmm, 7, i),
               again = passage_on(subject, edges, *ball, 0.2 * kmm, 7, i);
    ASSERT_TRUE(passage && again);
    EXPECT_EQ(passage->p_O, again->p_O);
    across += passage->is_across;
    glm::dvec3 last_O = passage->p_O[0];
    for (const glm::dvec3& p_O : passage->p_O) {
      EXPECT_NEAR(subject.truth.nearest(p_O).distance_m, 3.2 * kmm, 1e-6);
      EXPECT_LT(glm::distance(p_O, last_O), 2 * passage->step_m);
      last_O = p_O;
    }
    EXPECT_GE(passage->pressed.free_way_m, 0.2 * kmm);
    const RoundToolPose pressed = passage->pressed.round_pose(0.3 * kmm);
    EXPECT_NEAR(subject.truth.touch(ball->shape, pressed).main.depth_m, 0.3 * kmm, 1e-6);
  }
  EXPECT_GT(across, 5);
  EXPECT_LT(across, 35);
}

// What was flagged although every answer was right, and what was off and said nothing of it, are told apart.
TEST(TouchPassages, FlagsAreHeldAgainstWhatIsOff) {
  RimRow row;
  constexpr std::uint8_t kTwo = std::uint8_t{penetration::kGrazing} | std::uint8_t{contact::kFeltAsCoarse};
  row.add({.doubts = kTwo});
  row.add({.doubts = penetration::kGrazing, .is_off_flagged = true});
  row.add({.is_off_unflagged = true});
  RimRow sum;
  sum.add(row), sum.add(row);
  EXPECT_EQ(sum.passages, 6u);
  EXPECT_EQ(sum.flagged, 4u);
  EXPECT_EQ(sum.right_flagged, 2u);
  EXPECT_EQ(sum.off_unflagged, 2u);
  EXPECT_EQ(sum.doubted[2], 4u);  // grazing
  EXPECT_EQ(sum.doubted[5], 2u);  // felt as coarse
}

// A thick wall's rims: felt when pressed.
TEST(TouchPassages, EdgesThatArePressedAreFelt) {
  const TouchSubject subject(coarsely_baked("wall-30"));
  const FreeEdges edges(subject.baked.original_O);
  const auto ball = coarse_ball(6);
  Carrier carrier(subject, *ball);
  RimRow row;
  for (std::uint32_t i = 0; i < 40; ++i) {
    if (const auto passage = passage_on(subject, edges, *ball, 0.5 * kmm, 1, i)) row.add(carrier.carry(*passage));
  }
  EXPECT_GT(row.passages, 30u);
  EXPECT_EQ(row.missed_pressed, 0u);
}

}  // namespace
}  // namespace farfeel::bench
