// The device as something shared, changed and lost: frames, sessions, tiles, failures.
#include <atomic>
#include <thread>

#include "tests/support/realtime_guard.h"
#include "tests/unit/haptic_core/penetration/egl/device_fixture.h"

namespace farfeel::penetration::egl {
namespace {

class EglDevice : public OnDevice {};

Plates crossed_waves() {
  return {waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 4.2e-3, 0.6e-3, 0.9)};
}

std::vector<Query> random_queries(Plates& plates, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Query> queries;
  for (std::size_t i = 0; i < count; ++i) {
    press_at_random(plates, random, 0.05);
    queries.push_back(plates.query(i % 7 == 6 ? 0 : kDefaultSoftWidth_m));
    queries.back().wants_hessian = false;
  }
  return queries;
}

void expect_simds(BackEnd& simd, std::span<const Query> queries, std::span<const Penetration> answers) {
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const Penetration fast = evaluate(simd, queries[i]);
    if (fast.doubts & kCoarseSteps) continue;  // simd says that it did not resolve it
    EXPECT_NEAR(answers[i].depth_m, fast.depth_m, fast.doubts & kBorder ? 5e-6 : 0.4e-6) << i;
  }
}

TEST_F(EglDevice, OneFrameIsOneDispatch) {
  Plates plates = crossed_waves();
  const auto egl = back_end(plates);
  const std::vector<Query> queries = random_queries(plates, 100, 1);
  std::vector<Penetration> answers(queries.size());
  const Device::Counters before = device_->counters();
  egl->evaluate(queries, answers);
  EXPECT_EQ(device_->counters().dispatches, before.dispatches + 1);
  EXPECT_EQ(device_->counters().contacts, before.contacts + 100);
  expect_simds(*make_simd(kLimits), queries, answers);
}

TEST_F(EglDevice, MoreContactsThanAFrameHoldsGoInSeveral) {
  Plates plates = crossed_waves();
  const auto egl = back_end(plates);
  const std::vector<Query> queries = random_queries(plates, kMostContactsAFrame + 10, 2);
  std::vector<Penetration> answers(queries.size());
  egl->evaluate(queries, answers);
  expect_simds(*make_simd(kLimits), queries, answers);
  EXPECT_EQ(egl->tally().by_device, queries.size());
}

/// Each on a thread of its own, as sessions are; what they ask at one time goes together.
TEST_F(EglDevice, SessionsShareIt) {
  Plates plates = crossed_waves();
  constexpr std::size_t kSessions = 3, kFrames = 8;
  std::array<std::vector<Query>, kSessions> queries;
  std::array<std::vector<Penetration>, kSessions> answers;
  std::array<std::uint64_t, kSessions> by_device{};
  for (std::size_t i = 0; i < kSessions; ++i) {
    queries[i] = random_queries(plates, 7 * kFrames, 30 + static_cast<unsigned>(i));
    answers[i].resize(queries[i].size());
  }
  const Device::Counters before = device_->counters();
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < kSessions; ++i) {
      threads.emplace_back([&, i] {
        const auto egl = back_end(plates);
        for (std::size_t f = 0; f < kFrames; ++f)
          egl->evaluate(std::span(queries[i]).subspan(7 * f, 7), std::span(answers[i]).subspan(7 * f, 7));
        by_device[i] = egl->tally().by_device;
      });
    }
  }
  const auto simd = make_simd(kLimits);
  for (std::size_t i = 0; i < kSessions; ++i) {
    expect_simds(*simd, queries[i], answers[i]);
    EXPECT_EQ(by_device[i], queries[i].size());
  }
  const Device::Counters after = device_->counters();
  EXPECT_EQ(after.frames - before.frames, kSessions * kFrames);
  EXPECT_LE(after.dispatches - before.dispatches, kSessions * kFrames);
  if (device_->info().is_software) {  // a fast device may be done with one before the next one comes
    EXPECT_LT(after.dispatches - before.dispatches, kSessions * kFrames) << "no two frames went together";
  }
}

TEST_F(EglDevice, HasSoManyRingsAndNoMore) {
  std::vector<std::unique_ptr<EglBackEnd>> all;
  for (int i = 0; i < 4; ++i) all.push_back(make_egl(device_, kLimits));
  for (const auto& egl : all) EXPECT_TRUE(egl);
  EXPECT_FALSE(make_egl(device_, kLimits));
  Plates plates = crossed_waves();
  const auto last = egl_maker(device_)(kLimits);  // by simd
  EXPECT_TRUE(evaluate(*last, plates.query()).is_known());
  all.pop_back();
  EXPECT_TRUE(make_egl(device_, kLimits));
}

TEST_F(EglDevice, ASurfaceThatItWasNotGivenIsSimds) {
  Plates plates = crossed_waves();
  const auto egl = back_end();
  const Penetration ours = evaluate(*egl, plates.query()), fast = evaluate(*make_simd(kLimits), plates.query());
  EXPECT_EQ(ours.depth_m, fast.depth_m);
  EXPECT_EQ(egl->tally().by_simd, 1u);
}

/// An edit: a few tiles get other heights, and only those travel.
TEST_F(EglDevice, ChangedTilesAreFelt) {
  const auto surface = [](double height_m) { return waves({}, 1.5e-3, height_m, 0.3); };
  Plates plates(surface(0.3e-3), waves({.width_m = 0.004, .depth_m = 0.004}, 4.2e-3, 0.1e-3, 0.9));
  const geometry::HapticSurface lower = surface(0.1e-3);
  const auto egl = back_end(plates);
  const auto simd = make_simd(kLimits);
  std::mt19937 random(5);
  const auto compare = [&] {
    for (int trial = 0; trial < 6; ++trial) {
      press_at_random(plates, random, 0.02);
      const Penetration ours = evaluate(*egl, plates.query()), fast = evaluate(*simd, plates.query());
      EXPECT_NEAR(ours.depth_m, fast.depth_m, 0.2e-6);
      EXPECT_LT((ours.gradient - fast.gradient).tail<3>().norm(), 0.02);
    }
  };
  compare();
  plates.X_CT = {kTurnedOver, {0, 0, 0}};
  const double before_m = evaluate(*egl, plates.query()).depth_m;
  std::vector<std::uint32_t> changed;  // one tile after the other, so that what was changed once changes again
  const geometry::HeightScale scale = plates.s_surface.scale, other = lower.scale;
  for (std::uint32_t tile = 0; tile < lower.tiles.size(); ++tile) {
    geometry::HeightTile& to = plates.s_surface.tiles[tile];
    for (std::size_t i = 0; i < to.coefficients.size(); ++i) {
      const double height_m = other.height_m(lower.tiles[tile].coefficients[i]);
      to.coefficients[i] = static_cast<std::uint16_t>(std::lround((height_m - scale.offset_m) / scale.scale_m));
    }
    ++to.version;
    plates.s.take_tile(tile);
    if (tile % 16 == 15) evaluate(*egl, plates.query());
  }
  compare();
  // More tiles than a frame carries: simd answers until they are there.
  while (egl->tally().by_simd > 0) {
    const std::uint64_t by_simd = egl->tally().by_simd;
    plates.X_CT = {kTurnedOver, {0, 0, 0}};
    evaluate(*egl, plates.query());
    if (egl->tally().by_simd == by_simd) break;
  }
  compare();
  plates.X_CT = {kTurnedOver, {0, 0, 0}};
  EXPECT_LT(evaluate(*egl, plates.query()).depth_m, before_m - 0.05e-3);
}

TEST_F(EglDevice, AnswersWithoutAllocatingLockingOrThrowing) {
  if (!test_support::RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need malloc for themselves";
  Plates plates = crossed_waves();
  const auto egl = back_end(plates);
  std::vector<Query> queries = random_queries(plates, 7, 4);
  queries[3].wants_hessian = true;
  queries[5].window = {{0.1, 0.1}, {0.2, 0.2}};
  std::vector<Penetration> answers(queries.size());
  for (int frame = 0; frame < 10; ++frame) {
    const test_support::RealtimeGuard guard;
    egl->evaluate(queries, answers);
  }
  EXPECT_EQ(test_support::RealtimeGuard::violations(), 0u) << test_support::RealtimeGuard::first_violation();
  EXPECT_EQ(egl->tally().by_simd, 0u);
}

// Ways to fail, put in place of OpenGL's functions.
std::atomic<int> dispatches_left{0};
decltype(&glDispatchCompute) real_dispatch = nullptr;
decltype(&glClientWaitSync) real_wait = nullptr;
std::atomic<bool> is_reset{false};

void dispatch_until_broken(GLuint x, GLuint y, GLuint z) {
  if (dispatches_left.fetch_sub(1) > 0) real_dispatch(x, y, z);
}
GLenum reset_when_broken() {
  return is_reset ? GL_GUILTY_CONTEXT_RESET : GL_NO_ERROR;
}
GLenum never_done(GLsync sync, GLbitfield flags, GLuint64 timeout) {
  return dispatches_left > 0 ? real_wait(sync, flags, timeout) : GL_TIMEOUT_EXPIRED;
}

struct Failing {
  std::string why;
  std::shared_ptr<Device> device;  // last: its thread writes why
};

/// Works for `dispatches` frames after its warm-up.
std::unique_ptr<Failing> failing_device(int dispatches, bool by_reset, bool by_delay) {
  auto failing = std::make_unique<Failing>();
  dispatches_left = dispatches + 2 + (by_delay ? 1 : 0);  // two warm it up; the last one is never seen done
  is_reset = false;
  const auto opened = Device::open({.clients = 1,
                                    .patience_s = by_delay ? 1.0 : 0,
                                    .lost_after_s = 2,
                                    .most_empty = 3,
                                    .amend =
                                        [by_delay, by_reset](Gl& gl) {
                                          real_dispatch = gl.DispatchCompute;
                                          real_wait = gl.ClientWaitSync;
                                          gl.DispatchCompute = dispatch_until_broken;
                                          if (by_reset) gl.GetGraphicsResetStatus = reset_when_broken;
                                          if (by_delay) gl.ClientWaitSync = never_done;
                                        },
                                    .on_loss = [where = failing.get()](const std::string& why) { where->why = why; }});
  if (opened) failing->device = *opened;
  is_reset = by_reset;
  return failing;
}

/// A slide during which the device fails: no frame's force differs from simd's by more than the back ends do anyway.
void expect_no_jump(Failing& failing, int healthy) {
  constexpr double kStiffness_N_per_m = 10'000, kTolerance_N = 2e-3;
  Plates plates = crossed_waves();
  plates.X_CT.p.z = -0.1e-3;
  const auto egl = make_egl(failing.device, kLimits);
  egl->prepare(plates.s);
  egl->prepare(plates.t);
  const auto simd = make_simd(kLimits);
  for (int frame = 0; frame < 3 * healthy; ++frame) {
    plates.X_CT.p.x += 20e-6;
    Query query = plates.query();
    query.wants_hessian = false;
    const Penetration ours = evaluate(*egl, query), fast = evaluate(*simd, query);
    ASSERT_TRUE(ours.is_known());
    EXPECT_NEAR(kStiffness_N_per_m * ours.depth_m, kStiffness_N_per_m * fast.depth_m, kTolerance_N) << frame;
  }
  EXPECT_EQ(egl->tally().by_device, static_cast<std::uint64_t>(healthy));
  EXPECT_EQ(egl->tally().by_simd, static_cast<std::uint64_t>(2 * healthy));
}

TEST_F(EglDevice, AContextThatIsResetGivesWayToSimd) {
  const auto failing = failing_device(10, true, false);
  expect_no_jump(*failing, 10);
  EXPECT_TRUE(failing->device->is_lost());
  failing->device.reset();
  EXPECT_NE(failing->why.find("reset"), std::string::npos) << failing->why;
}

TEST_F(EglDevice, EmptyAnswersGiveWayToSimd) {
  const auto failing = failing_device(10, false, false);
  expect_no_jump(*failing, 10);
  EXPECT_TRUE(failing->device->is_lost());
}

TEST_F(EglDevice, ADeviceThatHangsGivesWayToSimd) {
  const auto failing = failing_device(10, false, true);
  expect_no_jump(*failing, 10);
}

TEST(EglOpening, SaysWhyItCannot) {
  const auto none = Device::open({.vendor = "a vendor that nobody is"});
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("OpenGL 4.5"), std::string::npos) << none.error().message;
}

TEST(EglOpening, AnEmptyFunctionIsAReason) {
  const auto broken = Device::open({.amend = [](Gl& gl) {
    gl.MapNamedBufferRange = [](GLuint, GLintptr, GLsizeiptr, GLbitfield) -> void* { return nullptr; };
  }});
  ASSERT_FALSE(broken);
  EXPECT_FALSE(broken.error().message.empty());
}

}  // namespace
}  // namespace farfeel::penetration::egl
