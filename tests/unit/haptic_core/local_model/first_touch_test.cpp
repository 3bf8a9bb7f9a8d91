// A tool that comes to a surface behind a link with a round trip of 100 ms feels it as soon as without one: by the
// outline, whichever rung, on surfaces with texture and without. On a simulated clock.
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <optional>

#include "codecs/felt/felt_outline.h"
#include "haptic_core/local_model/local_contacts.h"
#include "haptic_core/local_model/local_model.h"
#include "slave_sim/models/height_plate.h"
#include "tests/support/solids.h"

namespace farfeel::local_model {
namespace {

using contact_service::ToolPose;
using contact_service::TouchableObject;

constexpr double kTick_s = 1e-3;
constexpr int kRoundTrip = 100;   // ticks
constexpr int kBurst = 5;         // answers lost in a row
constexpr double kFelt_N = 0.05;  // less is no touch
constexpr double kMostExtra_m = 0.3e-3;

struct Surfaces {
  std::string name;
  geometry::HapticSurface tool, object;
};

/// The tool turned over, over the object. Lumps of 4 to 11 mm, half a millimetre high, with 30 um of grain of 0.7 mm.
std::vector<Surfaces> surfaces() {
  const auto lumps = [](double x_m, double y_m) {
    return 0.25e-3 * std::sin(700 * x_m + 1) * std::cos(570 * y_m) + 0.2e-3 * std::sin(1500 * x_m + 900 * y_m) +
           15e-6 * std::sin(9000 * x_m) * std::sin(8800 * y_m);
  };
  const slave_sim::PlateSize small{.size_m = {0.008, 0.006, 0.004}};
  return {{"ridges", slave_sim::ridged_plate(2e-3, 0.05e-3, small), slave_sim::ridged_plate(3e-3, 0.3e-3)},
          {"plain", support::untextured(support::box_mesh({0.008, 0.006, 0.004})),
           support::untextured(support::cylinder_mesh(0.02, 0.01, 48))},
          {"lumps", slave_sim::ridged_plate(2e-3, 0.05e-3, small), slave_sim::height_plate(lumps)}};
}

/// A hand that nothing stops, on a straight way.
struct Approach {
  glm::dvec3 from_m, v_m_s;
  [[nodiscard]] ToolPose at(int tick) const {
    // The plates' working faces look along +z: the tool is turned over.
    return {static_cast<std::uint32_t>(tick),
            tick * 1'000'000LL,
            {glm::dquat{0, 1, 0, 0}, from_m + kTick_s * tick * v_m_s},
            {{}, v_m_s}};
  }
};

class Touch {
 public:
  Touch(const Surfaces& pair, Rung rung, int late)
      : late_(late),
        object_{.felt = &pair.object, .material = {}},
        tool_{.felt = &pair.tool, .material = {}},
        remote_({&object_, 1}, tool_, {}),
        cache_(outline(pair)),
        local_(cache_),
        model_([rung] {
          LocalModelSettings settings;
          settings.rung = rung;
          return settings;
        }()) {}

  struct Moment {
    double force_N = 0, true_depth_m = 0;
    Felt felt;
  };
  Moment tick(const ToolPose& now) {
    model_.advance(kTick_s, now.X_WT);
    const contact::ContactSet& answer = remote_.answer(now);
    Moment moment;
    for (std::uint32_t c = 0; c < answer.count; ++c)
      moment.true_depth_m = std::max(moment.true_depth_m, answer.contacts[c].depth_m);
    under_way_.push_back(answer);
    if (under_way_.size() > static_cast<std::size_t>(late_)) {
      if (late_ == 0 || now.sequence % 100 >= kBurst) {
        local_.hear(under_way_.front());
        model_.hear(under_way_.front());
      }
      under_way_.pop_front();
    }
    last = model_.rung() == Rung::kTiles ? local_.at(now) : local_.beside_remote(now);
    model_.refresh(last, now.X_WT);
    moment.felt = model_.evaluate(now.X_WT, now.V_WT_W, kTick_s);
    const spatial::Vector6 V = spatial::to_vector6(now.V_WT_W);
    const spatial::Vector6 F = moment.felt.response.F_To_W + kTick_s * moment.felt.response.mean_by_way * V;
    moment.force_N = spatial::wrench_from(F).force_N.z;
    model_.settle(F, V, kTick_s, spatial::integrate(now.X_WT, now.V_WT_W, kTick_s));
    return moment;
  }
  TickContacts last;
  [[nodiscard]] const LocalModel& model() const { return model_; }

 private:
  static contact_service::FeltScene outline(const Surfaces& pair) {
    const penetration::FeltSurface tool(pair.tool), object(pair.object);
    const std::array bodies{TouchableObject{.felt = &pair.tool, .material = {}, .prepared = &tool},
                            TouchableObject{.felt = &pair.object, .material = {}, .prepared = &object}};
    return codecs::read_felt_outline(codecs::write_felt_outline(bodies, {}).value()).value();
  }

  int late_;
  TouchableObject object_, tool_;
  contact_service::ContactService remote_;
  TileCache cache_;  // no tiles ever come: they are late
  LocalContacts local_;
  LocalModel model_;
  std::deque<contact::ContactSet> under_way_;
};

std::vector<Approach> approaches() {
  std::vector<Approach> all;
  for (const double speed_m_s : {0.02, 0.3}) {
    const double above_m = std::max(2e-3, 0.15 * speed_m_s) + 6e-3;  // plain bodies' middles are half their heights up
    all.push_back({{0.3e-3, 0.2e-3, above_m}, {0, 0, -speed_m_s}});
    all.push_back({{-0.004, 0.001, above_m}, {0.5 * speed_m_s, -0.2 * speed_m_s, -speed_m_s}});
  }
  return all;
}

TEST(FirstTouch, BehindALinkIsFeltAsSoonAndAsHighAsWithout) {
  for (const Surfaces& pair : surfaces()) {
    for (const Rung rung : {Rung::kTiles, Rung::kLinear, Rung::kQuadratic}) {
      for (const Approach& approach : approaches()) {
        Touch far(pair, rung, kRoundTrip), near(pair, rung, 0);
        int far_tick = -1, near_tick = -1;
        double far_m = 0, near_m = 0, largest_step_N = 0, near_step_N = 0, before_N = 0, near_before_N = 0;
        for (int i = 0; i < 2000 && (far_tick < 0 || i < far_tick + 4); ++i) {
          const ToolPose now = approach.at(i);
          const Touch::Moment there = far.tick(now), here = near.tick(now);
          if (here.force_N > kFelt_N && near_tick < 0) near_tick = i, near_m = here.true_depth_m;
          if (there.force_N > kFelt_N && far_tick < 0) far_tick = i, far_m = here.true_depth_m;
          largest_step_N = std::max(largest_step_N, there.force_N - before_N);
          near_step_N = std::max(near_step_N, here.force_N - near_before_N);
          before_N = there.force_N, near_before_N = here.force_N;
          ASSERT_LT(here.true_depth_m, 5e-3) << "through";
        }
        const auto where = testing::Message() << pair.name << ", " << name(rung) << ", " << approach.v_m_s.z << " m/s";
        ASSERT_GE(near_tick, 0) << where;
        EXPECT_LE(far_m - near_m, kMostExtra_m) << where << " at tick " << far_tick << ", not " << near_tick;
        // Within a tick, or within what the outline's heights may be off.
        EXPECT_LE(far_m - near_m, -kTick_s * approach.v_m_s.z + 0.1e-3) << where;
        EXPECT_LE(largest_step_N, near_step_N + 0.35) << where;
      }
    }
  }
}

TEST(FirstTouch, WhereHeightsLackThatIsTold) {
  for (const Surfaces& pair : surfaces()) {
    const bool is_textured = pair.object.is_textured();
    Touch far(pair, Rung::kTiles, kRoundTrip);
    const Approach approach{{0.3e-3, 0.2e-3, is_textured ? 0.02 : 0.03}, {0, 0, -0.2}};
    Touch::Moment moment;
    for (int i = 0; i < 300 && moment.felt.pressing == 0; ++i) moment = far.tick(approach.at(i));
    ASSERT_GT(moment.felt.pressing, 0u) << pair.name;
    EXPECT_EQ(moment.felt.by_outline, is_textured ? moment.felt.pressing : 0u) << pair.name;
    for (std::uint32_t c = 0; c < far.last.set.count; ++c)
      EXPECT_EQ((far.last.set.contacts[c].doubts & contact::kFeltByOutline) != 0, is_textured) << pair.name;
    if (is_textured) {
      EXPECT_GT(moment.felt.outline_off_m, 0) << "no more than an estimate";
      EXPECT_LT(moment.felt.outline_off_m, 0.3e-3);
    }
    // The bound holds, whatever the texture.
    for (std::uint32_t c = 0; c < far.last.set.count; ++c)
      EXPECT_NEAR(far.last.set.contacts[c].depth_m, moment.true_depth_m, far.last.off_m[c] + 20e-6) << pair.name;
  }
}

// Pressed and slid at up to 0.25 m/s while the remote's contacts come late: however often told and found take turns,
// the force makes no jump that it would not make without a link, but for what one update may make, and no energy is
// made.
TEST(FirstTouch, ToldAndFoundTakeTurnsWithoutAJumpAndWithoutEnergy) {
  std::vector<Surfaces> slid = surfaces();
  // A tool so small that it goes down into every valley: what was told 10 mm ago tells nothing of here.
  for (const std::size_t textured : {0, 2})
    slid[textured].tool = slave_sim::ridged_plate(2e-3, 0.05e-3, {.size_m = {0.0012, 0.001, 0.004}});
  constexpr double kWay_m = 0.01, kPeriod = 250;  // ticks
  for (Surfaces& pair : slid) {
    for (const Rung rung : {Rung::kTiles, Rung::kLinear, Rung::kQuadratic}) {
      Touch far(pair, rung, 40), near(pair, rung, 0);
      const double z_m = pair.object.is_textured() ? -0.2e-3 : 5e-3 + 2e-3 - 0.2e-3;
      double before_N = 0, near_before_N = 0, largest_N = 0, near_largest_N = 0;
      int by_outline = 0, told = 0;
      for (int i = 0; i < 700; ++i) {
        const double turn = 2 * M_PI * i / kPeriod, v_m_s = kWay_m * 2 * M_PI / (kPeriod * kTick_s) * std::cos(turn);
        const glm::dvec3 p_m{kWay_m * std::sin(turn), 1e-3, z_m + std::max(0.0, 2e-3 - 2e-5 * i)};
        const ToolPose now{
            static_cast<std::uint32_t>(i), i * 1'000'000LL, {glm::dquat{0, 1, 0, 0}, p_m}, {{}, {v_m_s, 0, 0}}};
        const Touch::Moment there = far.tick(now), here = near.tick(now);
        if (i > 200) {
          largest_N = std::max(largest_N, std::abs(there.force_N - before_N));
          near_largest_N = std::max(near_largest_N, std::abs(here.force_N - near_before_N));
        }
        before_N = there.force_N, near_before_N = here.force_N;
        by_outline += there.felt.by_outline > 0;
        told += there.felt.pressing > there.felt.by_outline;
      }
      const auto where = testing::Message() << pair.name << ", " << name(rung);
      EXPECT_LT(largest_N, near_largest_N + 0.3) << where;
      EXPECT_GT(far.model().contact_port().least_J(), -0.002 - far.model().tank().allowed_J()) << where;
      if (pair.object.is_textured()) {
        EXPECT_GT(by_outline, 0) << where;
      }
      EXPECT_GT(told, 0) << where;
    }
  }
}

}  // namespace
}  // namespace farfeel::local_model
