#include "haptic_core/local_model/local_contacts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>

#include "haptic_core/local_model/local_model.h"
#include "tests/support/solids.h"
#include "tests/support/tiled_plates.h"

namespace farfeel::local_model {
namespace {

using contact_service::SurfaceTile;
using contact_service::ToolPose;
using test_support::TiledPlates;

constexpr double kTick_s = 1e-3;

ToolPose tool_at(int tick, double x_m, double depth_m, double speed_m_s = 0) {
  return {
      static_cast<std::uint32_t>(tick), tick * 1'000'000LL, TiledPlates::pose(x_m, depth_m), {{}, {speed_m_s, 0, 0}}};
}

/// Of the springs alone.
spatial::Vector6 contact_forces(const contact::ContactSet& set) {
  spatial::Vector6 sum = spatial::Vector6::Zero();
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const contact::Contact& c = set.contacts[i];
    sum -= c.material.stiffness_N_per_m * std::max(c.depth_m, 0.0) * c.gradient;
  }
  return sum;
}

TEST(LocalContacts, WithAllTilesTheyAreTheRemotesOwn) {
  const TiledPlates plates;
  TileCache cache(plates.outline());
  plates.send_all(cache);
  LocalContacts local(cache);
  contact_service::ContactService remote = plates.remote();
  for (int i = 0; i < 40; ++i) {
    const ToolPose tool = tool_at(i, 1e-4 * i, 0.1e-3);
    const contact::ContactSet& there = remote.answer(tool);
    const TickContacts& here = local.at(tool);
    ASSERT_EQ(here.set.count, there.count);
    ASSERT_EQ(here.from_tiles, there.count);
    for (std::uint32_t c = 0; c < there.count; ++c) {
      EXPECT_EQ(here.source[c], Source::kTiles);
      EXPECT_EQ(here.set.contacts[c].id, there.contacts[c].id);
      // Two quadratures of one integral: what each remembers of the contact decides its nodes.
      EXPECT_NEAR(here.set.contacts[c].depth_m, there.contacts[c].depth_m, 0.5e-6);
      EXPECT_LT((here.set.contacts[c].gradient - there.contacts[c].gradient).norm(), 1e-2);
    }
  }
}

/// Where crests stand against crests, sharp contacts are stiffer than the loop holds. Both ends widen them by one rule.
TEST(LocalContacts, AreAsWideAsTheRemotesWhereTheLoopCouldNotHoldThem) {
  TiledPlates plates;
  plates.material.stiffness_N_per_m = 8000;
  TileCache cache(plates.outline());
  plates.send_all(cache);
  LocalContacts local(cache);
  contact_service::ContactService sharp = plates.remote(),
                                  held = plates.remote(contact_service::kHeldStiffness_N_per_m);
  double widest_m = 0, turned = 0;
  for (int i = 0; i < 200; ++i) {
    const ToolPose tool = tool_at(i, 1e-5 * i, 0.4e-3);
    const contact_service::Answer &there = held.answer(tool), &unheld = sharp.answer(tool);
    const TickContacts& here = local.at(tool);
    ASSERT_EQ(here.set.count, there.count);
    for (std::uint32_t c = 0; c < there.count; ++c) {
      EXPECT_NEAR(here.set.contacts[c].depth_m, there.contacts[c].depth_m, 2e-6) << i;
      EXPECT_NEAR(unheld.contacts[c].depth_m, there.contacts[c].depth_m, 2e-6) << "a width changes the direction alone";
      turned = std::max(turned, (there.contacts[c].gradient - unheld.contacts[c].gradient).tail<3>().norm());
    }
    widest_m = std::max(widest_m, there.times.widest_m);
  }
  EXPECT_GT(widest_m, 12e-6);
  EXPECT_GT(turned, 0.005) << "without the rule it would be seen";
}

/// Flights of a thread lie above each other: no height field, but felt here like the rest, whatever the delay.
TEST(LocalContacts, LayersAreFeltHereOnceAllHeightsAre) {
  const support::Thread thread{.turns = 2, .sides = 8};
  const geometry::HapticSurface nut = support::untextured(support::nut_mesh(thread, 0.1e-3, 1)),
                                bolt = support::untextured(support::bolt_mesh(thread));
  contact_service::FeltScene scene;
  scene.tolerance_m = 1e-3;
  for (const geometry::HapticSurface* surface : {&nut, &bolt})
    scene.bodies.push_back({*surface, penetration::FeltSurface(*surface).limits(), {}, {}});
  TileCache cache(std::move(scene));
  LocalContacts local(cache);
  const contact_service::TouchableObject object{.felt = &bolt, .material = {}};
  contact_service::ContactService remote({&object, 1}, {.felt = &nut, .material = {}}, {.tolerance_m = 1e-3});
  std::uint32_t points = 0;
  for (int i = 0; i < 30; ++i) {
    const ToolPose tool{static_cast<std::uint32_t>(i), i * 1'000'000LL, {{1, 0, 0, 0}, {0, 0, 1e-5 * i}}, {}};
    const contact::ContactSet& there = remote.answer(tool);
    const TickContacts& here = local.at(tool);
    ASSERT_EQ(here.from_tiles, there.count) << i;
    EXPECT_EQ(here.lacking, 0u);
    for (std::uint32_t c = 0; c < there.count; ++c)
      EXPECT_NEAR(here.set.contacts[c].depth_m, there.contacts[c].depth_m, 1e-6) << i;
    points += local.last_times().point_contacts;
  }
  EXPECT_GT(points, 0u) << "no layers are near";
}

// 0.1 mm a tick over ridges of 2 and 3 mm: the surfaces' force changes by a tenth of itself in a tick.
TEST(LocalContacts, AmidATickTheyMakeTheForceThatBelongsToAllOfIt) {
  const double speed_m_s = 0.1;
  TiledPlates plates;
  plates.material.damping_Ns_per_m = plates.material.static_friction = plates.material.dynamic_friction = 0;
  TileCache cache(plates.outline());
  plates.send_all(cache);
  LocalContacts local(cache);
  contact_service::ContactService surface = plates.remote();
  LocalModelSettings settings;
  settings.rung = Rung::kTiles;
  LocalModel model(settings);
  double applied_off = 0, begun_off = 0;
  for (int i = 0; i < 300; ++i) {
    const double x_m = speed_m_s * kTick_s * (i % 100), depth_m = 0.2e-3;
    const ToolPose tool = tool_at(i, x_m, depth_m, speed_m_s);
    const contact::ContactSet amid = surface.answer(tool_at(i, x_m + 0.5 * speed_m_s * kTick_s, depth_m));
    model.hear(amid);
    model.advance(kTick_s, tool.X_WT);
    model.refresh(local.ahead_of(tool, model.ahead_s(tool.X_WT, tool.V_WT_W, kTick_s)), tool.X_WT);
    const tool::LinearResponse response = model.evaluate(tool.X_WT, tool.V_WT_W, kTick_s).response;
    const spatial::Vector6 V = spatial::to_vector6(tool.V_WT_W),
                           applied = response.F_To_W + kTick_s * response.mean_by_way * V;
    model.settle(applied, V, kTick_s, tool_at(i, x_m + speed_m_s * kTick_s, depth_m).X_WT);
    if (i % 100 < 50) continue;  // what was let in at the jump back is in
    const spatial::Vector6 true_force = contact_forces(amid);
    applied_off += (applied - true_force).tail<3>().squaredNorm();
    begun_off += (response.F_To_W - true_force).tail<3>().squaredNorm();
  }
  EXPECT_LT(applied_off, 0.05 * begun_off) << applied_off;
}

TEST(LocalContacts, WhereHeightsLackTheRemoteStandsInAndTheNeededTilesAreEnough) {
  const TiledPlates plates;
  TileCache cache(plates.outline());
  LocalContacts local(cache);
  contact_service::ContactService remote = plates.remote(), scout = plates.remote();
  const TickContacts& unheard = local.at(tool_at(0, 0, 0.1e-3));
  ASSERT_EQ(unheard.set.count, 1u);
  EXPECT_EQ(unheard.source[0], Source::kOutline);
  EXPECT_NEAR(unheard.set.contacts[0].depth_m, remote.answer(tool_at(0, 0, 0.1e-3)).contacts[0].depth_m,
              unheard.off_m[0]);
  local.hear(remote.answer(tool_at(0, 0, 0.1e-3)));
  const TickContacts first = local.at(tool_at(1, 0, 0.1e-3));
  ASSERT_EQ(first.set.count, 1u);
  EXPECT_EQ(first.from_remote, 1u);
  EXPECT_EQ(first.source[0], Source::kNewRemote);
  EXPECT_NEAR(first.set.contacts[0].depth_m, remote.answer(tool_at(1, 0, 0.1e-3)).contacts[0].depth_m, 0.3e-6);
  EXPECT_EQ(local.at(tool_at(2, 0, 0.1e-3)).source[0], Source::kOldRemote);
  // The tool has gone on since the remote was asked: what stands in is moved along to where the tool is.
  const ToolPose deeper = tool_at(2, 20e-6, 0.15e-3);
  const TickContacts moved = local.at(deeper);
  ASSERT_EQ(moved.source[0], Source::kOldRemote);
  EXPECT_NEAR(moved.set.contacts[0].depth_m, remote.answer(deeper).contacts[0].depth_m, 3e-6);

  const auto needed = scout.tiles_needed(tool_at(2, 0, 0.1e-3), 0).tiles;
  ASSERT_FALSE(needed.empty());
  EXPECT_LT(needed.size(), plates.table.tiles.size());
  for (const SurfaceTile& where : needed) ASSERT_EQ(cache.put(where, plates.tile(where)), TileCache::Put::kTaken);
  while (cache.take_arrived(100) > 0) continue;
  EXPECT_EQ(local.at(tool_at(3, 0, 0.1e-3)).source[0], Source::kTiles);
}

/// Contacts side by side along x, all pushing up.
contact::ContactSet side_by_side(std::initializer_list<double> xs_m) {
  contact::ContactSet set;
  for (const double x_m : xs_m) {
    contact::Contact& contact = set.contacts[set.count++];
    contact.p_WC_W = {x_m, 0, 0};
    contact.nhat_ST_W = {0, 0, 1};
  }
  return set;
}

TEST(LocalContacts, ARemoteContactThatIsFeltFromTilesStandsInForNoOther) {
  std::array<bool, contact::kMaxContacts> lacks{};
  lacks[1] = true;
  const contact::ContactSet ours = side_by_side({0, 0.010});
  // The remote sees one contact, which is our first: felt for the second too it would push twice.
  EXPECT_EQ(stand_ins(ours, lacks, side_by_side({0.001}))[1], kNobody);
  EXPECT_EQ(stand_ins(ours, lacks, side_by_side({0.001, 0.008}))[1], 1u);
  EXPECT_EQ(stand_ins(ours, lacks, side_by_side({0.013, 0.011}))[1], 1u) << "the nearer of two";
  EXPECT_EQ(stand_ins(ours, lacks, side_by_side({0.001, 0.008}))[0], kNobody) << "it has its own heights";
  contact::ContactSet opposed = side_by_side({0.010});
  opposed.contacts[0].nhat_ST_W = {0, 0, -1};
  EXPECT_EQ(stand_ins(ours, lacks, opposed)[1], kNobody);
}

TEST(FeltContact, WithItsCurvatureFollowsTheSurfaceFurther) {
  const TiledPlates plates;
  contact_service::ContactService remote = plates.remote(), there = plates.remote();
  double linear_m = 0, quadratic_m = 0;
  int compared = 0;
  for (int i = 0; i < 200; ++i) {
    ToolPose tool = tool_at(i, 1.3e-4 * i - 0.012, 0.1e-3);
    tool.wants_curvature = i % 2 == 0;
    const contact::ContactSet set = remote.answer(tool);
    for (std::uint32_t c = 0; c < set.count; ++c) EXPECT_EQ(set.contacts[c].curvature.is_known, tool.wants_curvature);
    if (set.count != 1 || !tool.wants_curvature) continue;
    contact::Contact plain = set.contacts[0];
    plain.curvature = {};
    const FeltContact bent = felt_contact(set.contacts[0], tool.X_WT), straight = felt_contact(plain, tool.X_WT);
    ToolPose moved = tool;  // by a tick at 80 mm/s, and turned a little
    moved.X_WT = spatial::integrate(tool.X_WT, {{2e-4, -1e-4, 3e-4}, {8e-5, 2e-5, -1e-5}}, 1);
    const contact::ContactSet& truth = there.answer(moved);
    if (truth.count != 1) continue;
    const double depth_m = truth.contacts[0].depth_m;
    linear_m += std::abs(straight.sample(moved.X_WT).depth_m - depth_m);
    quadratic_m += std::abs(bent.sample(moved.X_WT).depth_m - depth_m);
    ++compared;
  }
  ASSERT_GT(compared, 50);
  EXPECT_LT(quadratic_m, 0.4 * linear_m) << linear_m / compared << " m on average, linear";
}

TEST(TileCache, SurfacesMadeTileByTileAreThoseMadeAtOnce) {
  const TiledPlates plates;
  TileCache cache(plates.outline());
  plates.send_all(cache);
  const penetration::FeltSurface whole(plates.table), &grown = *cache.touchable()[1].prepared;
  const geometry::Chart& chart = plates.table.charts[0];
  const std::size_t coefficients = std::size_t{chart.columns + 2} * (chart.rows + 2);
  EXPECT_TRUE(std::equal(whole.packed(0).heights, whole.packed(0).heights + coefficients, grown.packed(0).heights));
  for (std::uint32_t level = 0; level < penetration::kBoundsLevels; ++level) {
    const penetration::BoundsLevel a = whole.bounds(0).level(level), b = grown.bounds(0).level(level);
    ASSERT_EQ(a.columns, b.columns);
    EXPECT_TRUE(std::equal(a.entries, a.entries + std::size_t{a.columns} * a.rows, b.entries)) << "level " << level;
  }
}

TEST(TileCache, TakesEachVersionOnceAndNothingThatIsNoTile) {
  const TiledPlates plates;
  TileCache cache(plates.outline());
  geometry::HeightTile tile = plates.table.tiles[0];
  tile.version = 7;
  EXPECT_EQ(cache.put({1, 0}, tile), TileCache::Put::kTaken);
  EXPECT_EQ(cache.put({1, 0}, tile), TileCache::Put::kTaken);
  tile.version = 6;
  EXPECT_EQ(cache.put({1, 0}, tile), TileCache::Put::kTaken);
  EXPECT_EQ(cache.tiles(), 1u);
  EXPECT_EQ(cache.put({2, 0}, tile), TileCache::Put::kUnknown);
  EXPECT_EQ(cache.put({1, 100'000}, tile), TileCache::Put::kUnknown);
  EXPECT_FALSE(cache.has({1, 0})) << "before the haptic thread has taken it over";
  EXPECT_EQ(cache.take_arrived(10), 1u);
  EXPECT_TRUE(cache.has({1, 0}));
  tile.version = 8;
  EXPECT_EQ(cache.put({1, 0}, tile), TileCache::Put::kTaken);
  EXPECT_EQ(cache.take_arrived(10), 1u);
  TileCache::Put last = TileCache::Put::kTaken;
  for (std::uint32_t version = 9; version < 2000 && last == TileCache::Put::kTaken; ++version) {
    tile.version = version;
    last = cache.put({1, 0}, tile);
  }
  EXPECT_EQ(last, TileCache::Put::kFull) << "the queue has no end";
}

TEST(TileCache, KnowsWhenASurfaceIsWhole) {
  const TiledPlates plates;
  TileCache cache(plates.outline());
  const auto count = static_cast<std::uint32_t>(plates.tool.tiles.size());
  for (std::uint32_t i = 0; i < count; ++i) {
    for (const std::uint32_t version : {1u, 2u}) {  // a newer one of the same place fills no other
      geometry::HeightTile tile = plates.tool.tiles[i];
      tile.version = version;
      EXPECT_FALSE(cache.has_all(0)) << i;
      EXPECT_EQ(cache.put({0, i}, tile), TileCache::Put::kTaken);
      EXPECT_EQ(cache.take_arrived(1), 1u);
      if (i + 1 == count) break;
    }
  }
  EXPECT_TRUE(cache.has_all(0));
  EXPECT_FALSE(cache.has_all(1));
}

/// Drags the tool over the table along a path, as a hand of infinite strength; the remote answers late.
struct Drag {
  explicit Drag(Rung rung, int late_ticks, double speed_m_s, bool has_tiles = true)
      : late(late_ticks), speed(speed_m_s), cache(plates.outline()), local(cache), model(settings(rung)) {
    if (has_tiles) plates.send_all(cache);
  }
  static TiledPlates without_friction() {
    TiledPlates plates;
    plates.material.static_friction = plates.material.dynamic_friction = 0;
    return plates;
  }
  static LocalModelSettings settings(Rung rung) {
    LocalModelSettings settings;
    settings.rung = rung;
    return settings;
  }
  /// Forth and back over 12 mm, pressed in by 0.2 mm.
  [[nodiscard]] ToolPose tool(int tick) const {
    const double way_m = std::fmod(speed * kTick_s * tick, 0.024);
    const bool is_forth = way_m < 0.012;
    return tool_at(tick, (is_forth ? way_m : 0.024 - way_m) - 0.006, 0.2e-3, is_forth ? speed : -speed);
  }
  /// Force along x and z of the model at the tick's pose, and the remote's at the same pose.
  struct Forces {
    glm::dvec3 felt_N, truth_N;
  };
  Forces tick(int i) {
    const ToolPose now = tool(i);
    model.advance(kTick_s, now.X_WT);
    const contact::ContactSet& answer = remote.answer(now);
    under_way.push_back(answer);
    if (under_way.size() > static_cast<std::size_t>(late)) {
      if (model.rung() == Rung::kTiles) {
        local.hear(under_way.front());
        model.hear(under_way.front());
      } else {
        model.update(under_way.front(), now.X_WT);
      }
      under_way.pop_front();
    }
    if (model.rung() == Rung::kTiles) {
      last = local.at(now);
      model.refresh(last, now.X_WT);
    }
    const spatial::Vector6 F = model.evaluate(now.X_WT, {}, kTick_s).response.F_To_W;
    const spatial::Vector6 V = spatial::to_vector6(now.V_WT_W);
    model.settle(F, V, kTick_s, spatial::integrate(now.X_WT, now.V_WT_W, kTick_s));
    glm::dvec3 truth_N{0};
    for (std::uint32_t c = 0; c < answer.count; ++c) {
      const contact::Contact& contact = answer.contacts[c];
      const double spring_N = contact.material.stiffness_N_per_m * std::max(0.0, contact.depth_m);
      truth_N -= spring_N * spatial::twist_from(contact.gradient).linear_m_s;
    }
    return {spatial::wrench_from(F).force_N, truth_N};
  }

  /// Rms of the error, over the truth's own variation.
  double error(int from, int to) {
    glm::dvec3 mean{0};
    double square = 0, error = 0;
    for (int i = 0; i < to; ++i) {
      const Forces f = tick(i);
      if (i < from) continue;
      error += glm::dot(f.felt_N - f.truth_N, f.felt_N - f.truth_N);
      square += glm::dot(f.truth_N, f.truth_N);
      mean += f.truth_N;
    }
    const double n = to - from;
    return std::sqrt((error / n) / (square / n - glm::dot(mean, mean) / (n * n)));
  }

  TiledPlates plates = without_friction();
  int late;
  double speed;
  TileCache cache;
  LocalContacts local;
  contact_service::ContactService remote = plates.remote();
  LocalModel model;
  std::deque<contact::ContactSet> under_way;
  TickContacts last;
};

TEST(LocalContacts, RidgesAreFeltThroughATenthOfASecondAsIfThereWereNone) {
  Drag tiles(Rung::kTiles, 100, 0.1), held(Rung::kHeldWrench, 100, 0.1), at_once(Rung::kTiles, 1, 0.1);
  const double with_tiles = tiles.error(200, 440), with_wrench = held.error(200, 440), here = at_once.error(200, 440);
  EXPECT_GT(with_wrench, 0.8);
  EXPECT_LT(with_tiles, 0.07 * with_wrench);
  EXPECT_LT(with_tiles, here + 0.01) << "the delay is felt";
}

TEST(LocalContacts, TilesThatArriveInMidContactMakeNoJump) {
  Drag drag(Rung::kTiles, 30, 0.01, false);
  glm::dvec3 before_N{0};
  double largest_N = 0, ordinary_N = 0;
  for (int i = 0; i < 700; ++i) {
    if (i == 400) drag.plates.send_all(drag.cache);
    const Drag::Forces f = drag.tick(i);
    EXPECT_TRUE(std::isfinite(f.felt_N.x + f.felt_N.y + f.felt_N.z));
    if (i == 399) {
      EXPECT_EQ(drag.last.from_tiles, 0u);
    }
    const double step_N = glm::distance(f.felt_N, before_N);
    if (i >= 400 && i < 450) largest_N = std::max(largest_N, step_N);
    if (i >= 500) {
      EXPECT_EQ(drag.last.from_tiles, drag.last.set.count);
      ordinary_N = std::max(ordinary_N, step_N);
    }
    before_N = f.felt_N;
  }
  EXPECT_LT(largest_N, 0.35 + ordinary_N);  // kFreeStep_N along and kSlopeStep_N across the direction
}

}  // namespace
}  // namespace farfeel::local_model
