#include "haptic_core/local_model/local_model.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "haptic_core/local_model/constants.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::local_model {
namespace {

using spatial::Pose;
using spatial::Twist;
using spatial::Vector6;

constexpr double kTick_s = 1e-3;

/// Point contacts of a tool's bottom with the plane z = 0.
contact::ContactSet on_plane(const Pose& X_WT, double level_m = 0, double stiffness_N_per_m = 2000) {
  contact::ContactSet set;
  set.X_WT = X_WT;
  for (const glm::dvec3& point : {glm::dvec3(0.02, 0, 0), glm::dvec3(-0.02, 0, 0)}) {
    contact::Contact& contact = set.contacts[set.count];
    contact.id = set.count++;
    contact.p_WC_W = spatial::transform_point(X_WT, point);
    contact.nhat_ST_W = {0, 0, 1};
    contact.depth_m = level_m - contact.p_WC_W.z;
    contact.gradient =
        spatial::to_vector6(Twist{glm::cross(contact.p_WC_W - X_WT.p, glm::dvec3(0, 0, -1)), {0, 0, -1}});
    contact.lateral_range_m = 1;
    contact.material.stiffness_N_per_m = stiffness_N_per_m;
  }
  return set;
}

Pose at_height(double z_m) {
  return {{1, 0, 0, 0}, {0, 0, z_m}};
}

double force_z(const LocalModel& model, const Pose& X_WT) {
  return model.evaluate(X_WT, {}, kTick_s).response.F_To_W[5];
}

/// Over a tick in which the tool moves with this twist.
Vector6 mean_wrench(const tool::LinearResponse& response, const Vector6& twist) {
  return response.F_To_W + kTick_s * ((response.by_pose + response.mean_by_way) * twist);
}

/// Moves a tool along a path at will and books its work, as the loop does.
struct Puppet {
  explicit Puppet(const LocalModelSettings& settings) : model(settings) {}
  void move(const Twist& V) {
    model.advance(kTick_s, X_WT);
    if (has_news) model.update(news, X_WT);
    const Felt felt = model.evaluate(X_WT, V, kTick_s);
    const Vector6 twist = spatial::to_vector6(V);
    X_WT = spatial::integrate(X_WT, V, kTick_s);
    model.settle(mean_wrench(felt.response, twist), twist, kTick_s, X_WT);
    has_news = false;
  }
  LocalModel model;
  Pose X_WT;
  contact::ContactSet news;
  bool has_news = false;
};

TEST(LocalModelTest, NearContactsComeAliveOnApproach) {
  LocalModel model{LocalModelSettings{}};
  EXPECT_EQ(model.freshness(), Freshness::kNone);
  model.update(on_plane(at_height(0.001)), at_height(0.001));
  EXPECT_EQ(force_z(model, at_height(0.001)), 0);
  EXPECT_EQ(model.evaluate(at_height(0.0001), {}, kTick_s).pressing, 0u);
  EXPECT_NEAR(force_z(model, at_height(-0.0005)), 2, 1e-9);  // two contacts, 2000 N/m each
  EXPECT_NEAR(model.evaluate(at_height(-0.0005), {}, kTick_s).energy_J, 2 * 0.5 * 2000 * 0.0005 * 0.0005, 1e-12);
}

TEST(LocalModelTest, NeverPullsHoweverFastTheyPart) {
  LocalModel model{LocalModelSettings{}};
  model.update(on_plane(at_height(0.001)), at_height(0.001));
  for (double speed : {0.01, 0.1, 1.0, 10.0})
    for (double z : {-0.002, -0.0002, -0.00001, 0.0001})
      EXPECT_GE(model.evaluate(at_height(z), {{0, 0, 0}, {0, 0, speed}}, kTick_s).response.F_To_W[5], 0);
}

TEST(LocalModelTest, ResponseMatchesFiniteDifferencesOfItsWrench) {
  LocalModel model{LocalModelSettings{}};
  contact::ContactSet smooth = on_plane(at_height(0.001));
  for (contact::Contact& contact : smooth.contacts)
    contact.material.static_friction = contact.material.dynamic_friction = 0;
  model.update(smooth, at_height(0.001));
  const Pose X = spatial::integrate(at_height(-0.001), {{0.002, 0.003, 0.001}, {0, 0, 0}}, 1);
  const Twist V{{0.01, 0.02, 0.03}, {0.0, 0.0, 0.01}};
  const Felt here = model.evaluate(X, V, kTick_s);
  for (int axis = 0; axis < 6; ++axis) {
    const Vector6 d = 1e-7 * Vector6::Unit(axis);
    const auto at = [&](double sign) {
      return model.evaluate(spatial::integrate(X, spatial::twist_from(sign * d), 1), {}, kTick_s).response.F_To_W;
    };
    const Felt still = model.evaluate(X, {}, kTick_s);
    // Of the spring only, and without the turning of the arms with the tool, which the implicit step leaves out: each
    // force turns about To by (e x r) x F. All forces here are along z, so the torque tells the arms' sum; their height
    // of some micrometres is left.
    const glm::dvec3 F_N = spatial::wrench_from(still.response.F_To_W).force_N,
                     T_Nm = spatial::wrench_from(still.response.F_To_W).torque_Nm;
    ASSERT_NEAR(glm::length(glm::dvec2(F_N)), 0, 1e-12);
    const glm::dvec3 arm_m{-T_Nm.y / F_N.z, T_Nm.x / F_N.z, 0},
        e = axis < 3 ? glm::dvec3(axis == 0, axis == 1, axis == 2) : glm::dvec3{0};
    Vector6 expected = still.response.by_pose.col(axis);
    expected += spatial::to_vector6(spatial::Wrench{glm::cross(glm::cross(e, arm_m), F_N), {}});
    const Vector6 error = (at(1) - at(-1)) / 2e-7 - expected;
    EXPECT_LE(error.norm(), axis < 3 ? 1e-4 : 1e-6) << axis << ", of columns of 1.6 N m/rad and 4000 N/m";
  }
  EXPECT_LE(here.response.F_To_W.dot(spatial::to_vector6(V)) -
                model.evaluate(X, {}, kTick_s).response.F_To_W.dot(spatial::to_vector6(V)),
            0);  // damping only ever takes
}

/// A tool of 20 g on the plane, pressed down and pushed sideways, moved by the implicit step as the loop does.
struct Pushed {
  explicit Pushed(double press_N) : model(LocalModelSettings{}) {
    body.X_WT = at_height(-press_N / (2 * 2000));
    model.update(on_plane(at_height(0.001)), body.X_WT);
  }
  void tick(const glm::dvec3& push_N) {
    model.advance(kTick_s, body.X_WT);
    model.update(on_plane(body.X_WT), body.X_WT);
    const Felt felt = model.evaluate(body.X_WT, body.V_WT_W, kTick_s);
    tool::LinearResponse forces = felt.response;
    forces.F_To_W += spatial::to_vector6(spatial::Wrench{{}, push_N});
    const tool::StepWork stepped = tool::step(body, forces, kTick_s);
    const Vector6 applied = tool::applied_wrench(felt.response, stepped, kTick_s);
    friction_N = glm::length(glm::dvec2(applied[3], applied[4]));
    model.settle(applied, stepped.V_moved, kTick_s, body.X_WT);
  }
  LocalModel model;
  tool::RigidTool body;
  double friction_N = 0;
};

TEST(LocalModelTest, FrictionHoldsASidewaysLoadWithoutCreepAndLetsGoAboveTheLimit) {
  constexpr double kPress_N = 4;  // static limit 1.2 N, dynamic 1 N
  Pushed pushed(kPress_N);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto load = [&](double sideways_N) {
    pushed.tick({sideways_N, 0.05 * uniform(random), -kPress_N + 0.05 * uniform(random)});
  };
  for (int i = 0; i < 1000; ++i) load(std::min(1.0, 0.002 * i));
  const double settled_m = pushed.body.X_WT.p.x;
  EXPECT_GT(settled_m, 0);
  EXPECT_LT(settled_m, 0.4e-3);  // two springs of 1640 N/m under 1 N stretch by 0.3 mm
  for (int i = 0; i < 10'000; ++i) load(1.0);
  EXPECT_NEAR(pushed.body.X_WT.p.x, settled_m, 10e-6) << "creeps";
  for (int i = 0; i < 300; ++i) load(1.4);
  EXPECT_GT(pushed.body.X_WT.p.x, settled_m + 0.1) << "does not slide";
  EXPECT_NEAR(pushed.friction_N, 1.0, 0.03);
}

TEST(LocalModelTest, AnUpdateThatSaysTheSameIsNotFelt) {
  Puppet puppet{{}};
  puppet.X_WT = at_height(0.001);
  for (int i = 0; i < 200; ++i) {
    puppet.news = on_plane(puppet.X_WT);
    puppet.has_news = i % 3 == 0;
    puppet.move({{0, 0, 0}, {0.05, 0, i < 30 ? -0.05 : 0}});
  }
  EXPECT_NEAR(force_z(puppet.model, puppet.X_WT), 2 * 2000 * 0.0005, 1e-6);
  EXPECT_EQ(puppet.model.truncations(), 0u);
}

TEST(LocalModelTest, AWallThatRisesUnderTheToolIsPaidByTheTank) {
  LocalModelSettings settings;
  settings.tank.allowance_W = 0;
  Puppet puppet{settings};
  puppet.X_WT = at_height(-0.0005);
  puppet.news = on_plane(at_height(0.001));
  puppet.has_news = true;
  puppet.move({});
  puppet.news = on_plane(puppet.X_WT, 0.0015);
  puppet.has_news = true;
  double last = force_z(puppet.model, puppet.X_WT);
  for (int i = 0; i < 500; ++i) {
    puppet.move({});
    const double now = force_z(puppet.model, puppet.X_WT);
    EXPECT_LE(std::abs(now - last), kFreeStep_N + kBleed_N_per_s * kTick_s + 1e-9);
    last = now;
  }
  EXPECT_LE(last, 1e-3);  // nothing was ever dissipated: nothing may be given
  EXPECT_GE(puppet.model.truncations(), 1u);

  settings.tank.allowance_W = 0.01;  // the stated policy: a wall that appears is felt after a while
  Puppet allowed{settings};
  allowed.X_WT = puppet.X_WT;
  for (int i = 0; i < 3000; ++i) {
    allowed.news = on_plane(allowed.X_WT, 0.0015);
    allowed.has_news = i % 2 == 0;
    allowed.move({});
  }
  EXPECT_NEAR(force_z(allowed.model, allowed.X_WT), 2 * 2000 * 0.002, 0.05);
}

// Both ends of the tool are as deep: the one that the tank is asked for first may not be paid first, and turn the tool.
TEST(LocalModelTest, WhatTheTankLacksEveryContactLacksAlike) {
  Puppet puppet{{}};
  puppet.X_WT = at_height(-0.0005);
  puppet.news = on_plane(puppet.X_WT);
  puppet.has_news = true;
  puppet.move({});
  double most_Nm = 0, most_N = 0;
  for (int i = 0; i < 200; ++i) {
    puppet.move({});
    const Vector6 F_To_W = puppet.model.evaluate(puppet.X_WT, {}, kTick_s).response.F_To_W;
    most_Nm = std::max(most_Nm, F_To_W.head<3>().norm()), most_N = std::max(most_N, F_To_W[5]);
  }
  EXPECT_GT(most_N, 0.5);
  EXPECT_LT(most_N, 1.9) << "all of it: the tank lacked nothing";
  EXPECT_LT(most_Nm, 1e-9);
}

// What the remote's patches make when they are made anew reaches the hand as a change of the model's own energy, at the
// tool's pose, and that is what the tank pays, once.
TEST(LocalModelTest, WhatNewPatchesMakeIsPaidByTheTankOnce) {
  LocalModelSettings settings;
  settings.tank = {.cap_J = 1, .allowance_W = 0};
  LocalModel model{settings};
  const Pose X_WT = at_height(0);
  const auto hear = [&](double level_m, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const contact::ContactSet set = on_plane(X_WT, level_m);
      model.advance(kTick_s, X_WT);
      model.update(set, X_WT);
      model.settle(Vector6::Zero(), Vector6::Zero(), kTick_s, X_WT);
    }
    return model.evaluate(X_WT, {}, kTick_s).energy_J;
  };
  Vector6 brake = Vector6::Zero(), way = Vector6::Zero();
  brake[5] = -100, way[5] = 1;
  model.settle(brake, way, kTick_s, X_WT);  // a hand has put 0.1 J into the tank
  ASSERT_NEAR(model.tank().level_J(), 0.1, 1e-9);
  const double before_J = hear(0.2e-3, 300), tank_J = model.tank().level_J();
  const double after_J = hear(1.2e-3, 600);
  EXPECT_NEAR(after_J, 2 * 0.5 * 2000 * 1.2e-3 * 1.2e-3, 1e-6);
  EXPECT_NEAR(tank_J - model.tank().level_J(), after_J - before_J, 1e-6) << "the tool stood still";
}

/// on_plane as rung 3 takes it over: evaluated at this very pose.
TickContacts from_tiles(const Pose& X_WT, double level_m) {
  TickContacts tick;
  tick.set = on_plane(X_WT, level_m);
  tick.from_tiles = tick.set.count;
  tick.source.fill(Source::kTiles);
  return tick;
}

TEST(LocalModelTest, DepthsThatJumpFromTickToTickAreLetInAndNotFeltAtOnce) {
  // Clusters that re-form make a contact of the same name deeper by millimetres for a tick, or lose it in a gap.
  for (const double allowance_W : {0.0, 1.0})
    for (const double jump_m : {2e-3, -0.028, 0.028}) {
      LocalModelSettings settings;
      settings.rung = Rung::kTiles;
      settings.tank.allowance_W = allowance_W;
      LocalModel model(settings);
      const Pose X_WT = at_height(-0.0005);
      double before_N = 0, most_J = 0, jumped_N = 0;
      for (int tick = 0; tick < 400; ++tick) {
        model.advance(kTick_s, X_WT);
        model.hear({});
        model.refresh(from_tiles(X_WT, tick > 200 && tick % 2 == 0 ? jump_m : 0), X_WT);
        const double force_N = force_z(model, X_WT);
        if (tick > 200) jumped_N = std::max(jumped_N, std::abs(force_N - before_N));
        before_N = force_N;
        model.settle(Vector6::Zero(), Vector6::Zero(), kTick_s, X_WT);
        most_J = std::max(most_J, model.evaluate(X_WT, {}, kTick_s).energy_J);
      }
      EXPECT_LE(jumped_N, 0.21) << jump_m << ": a free step and a tick of letting in";
      EXPECT_GE(model.tank().level_J(), -1e-9) << jump_m;
      EXPECT_LE(most_J, allowance_W > 0 ? 0.005 : 1e-9) << jump_m << ": more than was put in";
    }
}

TEST(LocalModelTest, DepthsThatNoGradientPromisedCarryAToolUpNoFurtherThanTheTankMayOwe) {
  LocalModelSettings settings;
  settings.rung = Rung::kTiles;
  LocalModel model(settings);
  Pose X_WT = at_height(0.0005);
  const Twist down{{0, 0, 0}, {0, 0, -0.01}}, up{{0, 0, 0}, {0.1, 0, 0.02}};
  double least_J = 0;
  for (int tick = 0; tick < 1000; ++tick) {
    const Twist V = tick < 150 ? down : up;
    model.advance(kTick_s, X_WT);
    model.hear({});
    TickContacts here = from_tiles(X_WT, 0.2 * X_WT.p.x);  // as deep all the way, while every gradient says flat
    for (contact::Contact& contact : here.set.contacts)
      contact.material.static_friction = contact.material.dynamic_friction = 0;
    model.refresh(here, X_WT);
    const Felt felt = model.evaluate(X_WT, V, kTick_s);
    X_WT = spatial::integrate(X_WT, V, kTick_s);
    model.settle(mean_wrench(felt.response, spatial::to_vector6(V)), spatial::to_vector6(V), kTick_s, X_WT);
    least_J = std::min(least_J, model.tank().level_J());
  }
  EXPECT_GE(least_J, -kSurprise_J - 1e-9);
}

TEST(LocalModelTest, AForceThatIsLetGoDoesNotGrowOnTheWayToASurfaceThatIsNotReached) {
  LocalModelSettings settings;
  settings.rung = Rung::kTiles;
  settings.tank.allowance_W = 1;
  LocalModel model(settings);
  double before_N = 1e9, first_N = 0;
  for (int tick = 0; tick < 300; ++tick) {
    const int since = tick - 200;  // the surface sinks by 3 mm, and the tool goes after it by 0.1 mm a tick
    const Pose X_WT = at_height(-0.0005 - (since > 0 ? std::min(since, 20) * 1e-4 : 0));
    model.advance(kTick_s, X_WT);
    model.hear({});
    model.refresh(from_tiles(X_WT, since > 0 ? -3e-3 : 0), X_WT);
    const double force_N = force_z(model, X_WT);
    if (since == 0) first_N = force_N;
    if (since > 2) {
      EXPECT_LE(force_N, before_N + 1e-9) << since;
    }
    before_N = force_N;
    model.settle(Vector6::Zero(), Vector6::Zero(), kTick_s, X_WT);
  }
  EXPECT_GT(first_N, 1);
  EXPECT_LT(before_N, 0.01);
}

TEST(LocalModelTest, WhatIsGoneAndPushedLittleLeavesInATimeThatGoesWithItsForce) {
  for (const double force_N : {0.08, 0.24}) {
    LocalModel model{LocalModelSettings{}};
    const Pose X_WT = at_height(-force_N / 4000);
    model.update(on_plane(at_height(0.001)), at_height(0.001));
    model.advance(0, X_WT);
    ASSERT_NEAR(force_z(model, X_WT), force_N, 1e-6);
    model.update({}, X_WT);
    int ticks = 0;
    for (; force_z(model, X_WT) > 0 && ticks < 100; ++ticks) model.advance(kTick_s, X_WT);
    EXPECT_LE(ticks, std::ceil(force_N / 0.08) + 1);
  }
}

// Where two contacts find one place the remote fades one of them: to next to nothing in one tick, and back in another.
TEST(LocalModelTest, AStiffnessThatComesAndGoesIsNeverMetresDeep) {
  LocalModelSettings settings;
  settings.rung = Rung::kTiles;
  settings.tank = {.cap_J = 0.005, .allowance_W = 0.1};
  LocalModel model(settings);
  const Pose X_WT = at_height(-0.0005);
  double before_N = 0, most_J = 0, largest_N = 0;
  for (int tick = 0; tick < 600; ++tick) {
    model.advance(kTick_s, X_WT);
    model.hear({});
    TickContacts here = from_tiles(X_WT, 0);
    constexpr std::array<double, 5> kShares{1, 1e-3, 1, 0.6, 1e-6};
    if (tick > 300) here.set.contacts[0].material.stiffness_N_per_m *= kShares[static_cast<std::size_t>(tick) % 5];
    model.refresh(here, X_WT);
    const double force_N = force_z(model, X_WT);
    if (tick > 300) largest_N = std::max(largest_N, std::abs(force_N - before_N));
    before_N = force_N;
    model.settle(Vector6::Zero(), Vector6::Zero(), kTick_s, X_WT);
    most_J = std::max(most_J, model.evaluate(X_WT, {}, kTick_s).energy_J);
  }
  EXPECT_LT(most_J, 1.5 * 2 * 0.5 * 2000 * 0.0005 * 0.0005) << "no more than two contacts store, and one that leaves";
  EXPECT_LT(largest_N, 0.5) << "of two newtons in all";
  EXPECT_GE(model.tank().level_J(), -1e-9);
}

TEST(LocalModelTest, APointThatJumpsTurnsTheToolNoFasterThanAStep) {
  LocalModelSettings settings;
  settings.rung = Rung::kTiles;
  settings.tank = {.cap_J = 0.1, .allowance_W = 1};
  LocalModel model(settings);
  const Pose X_WT = at_height(-0.001);
  double before_Nm = 0, most_Nm = 0, last_Nm = 0;
  for (int tick = 0; tick < 600; ++tick) {
    model.advance(kTick_s, X_WT);
    model.hear({});
    TickContacts here = from_tiles(X_WT, 0);
    if (tick >= 500) {
      for (std::uint32_t i = 0; i < here.set.count; ++i) {
        contact::Contact& contact = here.set.contacts[i];
        contact.p_WC_W.x += 0.008;
        contact.gradient.head<3>() = spatial::to_eigen(glm::cross(contact.p_WC_W - X_WT.p, glm::dvec3(0, 0, -1)));
      }
    }
    model.refresh(here, X_WT);
    last_Nm = model.evaluate(X_WT, {}, kTick_s).response.F_To_W[1];
    if (tick >= 500) most_Nm = std::max(most_Nm, std::abs(last_Nm - before_Nm));
    before_Nm = last_Nm;
    model.settle(Vector6::Zero(), Vector6::Zero(), kTick_s, X_WT);
  }
  EXPECT_NEAR(last_Nm, -4 * 0.008, 1e-3) << "two contacts of 2 N, in the end where they are";
  EXPECT_LE(most_Nm, 2 * kTorqueStep_Nm);
}

TEST(LocalModelTest, BooksBalanceUnderRandomMotionAndRandomUpdates) {
  // Energy into the port + allowance >= what is stored + what the tank holds, at every tick.
  std::mt19937 random(17);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    Puppet puppet{{}};
    puppet.X_WT = at_height(0.0005);
    double slack_J = 0;
    for (int i = 0; i < 2000; ++i) {
      if (random() % 4 == 0) {
        puppet.has_news = true;
        puppet.news = on_plane(puppet.X_WT, 0.0005 * uniform(random), 2000 * (1.5 + uniform(random)));
        puppet.news.contacts[0].id = static_cast<std::uint32_t>(random() % 3);
        if (random() % 10 == 0) puppet.news.count = 1;
      }
      puppet.move({{0.2 * uniform(random), 0.2 * uniform(random), 0},
                   {0.1 * uniform(random), 0.1 * uniform(random), 0.05 * uniform(random) - 20 * puppet.X_WT.p.z}});
      const LocalModel& model = puppet.model;
      const double stored_J = model.evaluate(puppet.X_WT, {}, kTick_s).energy_J;
      slack_J = model.contact_port().energy_J() + model.tank().allowed_J() - stored_J - model.tank().level_J();
      ASSERT_GE(slack_J, -1e-9) << "tick " << i;
    }
  }
}

TEST(LocalModelTest, SilenceHoldsTheGeometryThenFadesTheForce) {
  LocalModel model{LocalModelSettings{}};
  const Pose X = at_height(-0.0005);
  model.update(on_plane(at_height(0.001)), at_height(0.001));
  double last = force_z(model, X);
  const auto wait = [&](double seconds) {
    for (int i = 0; i < std::lround(seconds / kTick_s); ++i) {
      model.advance(kTick_s, X);
      EXPECT_LE(last - force_z(model, X), 0.05);
      last = force_z(model, X);
    }
  };
  wait(0.045);
  EXPECT_EQ(model.freshness(), Freshness::kFresh);
  wait(0.1);
  EXPECT_EQ(model.freshness(), Freshness::kHeld);
  EXPECT_NEAR(last, 2, 1e-9);
  wait(0.11);
  EXPECT_EQ(model.freshness(), Freshness::kExpired);
  wait(0.1);
  EXPECT_EQ(last, 0);
}

TEST(LocalModelTest, AHeldWrenchBeginsToFadeAtOnceWhenItIsHeld) {
  LocalModelSettings settings;
  settings.rung = Rung::kHeldWrench;
  LocalModel model{settings};
  contact::ContactSet set;
  set.F_To_W.force_N = {0, 0, 2};
  model.update(set, {});
  const auto after = [&](double seconds) {
    for (int i = 0; i < std::lround(seconds / kTick_s); ++i) model.advance(kTick_s, {});
    return force_z(model, {});
  };
  EXPECT_NEAR(after(0.05), 2, 0.02);
  EXPECT_NEAR(after(0.1), 1, 0.02);
  EXPECT_NEAR(after(0.101), 0, 1e-12);
}

}  // namespace
}  // namespace farfeel::local_model
