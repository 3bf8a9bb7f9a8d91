// The whole loop on textured plates whose remote is a round trip away: held still, and through a silence of the remote.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <deque>

#include "tests/support/tiled_plates.h"
#include "tests/unit/master_station/haptic_loop/rig.h"

namespace farfeel::master_station {
namespace {

class DistantPlates final : public Remote {
 public:
  DistantPlates(const test_support::TiledPlates& plates, int round_trip_ticks)
      : service_(plates.remote()), late_(static_cast<std::size_t>(round_trip_ticks)) {}
  void send(const ToolState& state) noexcept override { under_way_.push_back(state); }
  bool poll(contact::ContactSet& newest) noexcept override {
    if (under_way_.size() <= late_) return false;
    const ToolState& then = under_way_.front();
    newest = service_.answer({then.sequence, then.time_ns, then.X_WT, then.V_WT_W});
    under_way_.pop_front();
    return !is_silent;
  }
  bool is_silent = false;

 private:
  contact_service::ContactService service_;
  std::size_t late_;
  std::deque<ToolState> under_way_;
};

struct OnPlates {
  OnPlates(const Grip& grip, int round_trip_ticks, bool tiles_may_rest = false)
      : remote(plates, round_trip_ticks), device(Rig::device_settings(grip)) {
    plates.send_all(cache);
    device.hold_at(test_support::TiledPlates::pose(0.4e-3, -2e-3));
    HapticLoopSettings settings = Rig::loop_settings(local_model::Rung::kTiles);
    settings.tiles_may_rest = tiles_may_rest;
    settings.body = {0.02, Eigen::Vector3d(1e-6, 1e-6, 1e-6).asDiagonal()};
    loop = std::make_unique<HapticLoop>(device, remote, settings, &contacts);
    for (int i = 0; i < 400; ++i) tick();  // from where the device starts to over the plate
    device.hold_at(test_support::TiledPlates::pose(0.4e-3, 3 / grip.stiffness_N_per_m));
  }
  /// previous_work: of a period, what the tick before took.
  TickRecord tick(double previous_work = 0) {
    loop->tick({time_ns, 0, std::llround(previous_work * kTick_ns), 0});
    time_ns += kTick_ns;
    TickRecord record;
    EXPECT_TRUE(loop->records().pop(record));
    return record;
  }
  test_support::TiledPlates plates;
  local_model::TileCache cache{plates.outline()};
  local_model::LocalContacts contacts{cache};
  DistantPlates remote;
  SimulatedDevice device;
  std::unique_ptr<HapticLoop> loop;
  std::int64_t time_ns = 5'000'000'000;
};

TEST(TilesInTheLoop, PressedStillTheyAreCalmAtAnyDelay) {
  for (const Grip& grip : {kSoftGrip, kHardGrip}) {
    for (const int round_trip_ticks : {2, 20, 50, 100, 200}) {
      OnPlates on(grip, round_trip_ticks);
      for (int i = 0; i < 700; ++i) on.tick();
      double low_N = 1e9, high_N = 0, sum_N = 0;
      for (int i = 0; i < 300; ++i) {
        const TickRecord record = on.tick();
        EXPECT_EQ(record.rung, 3);
        const double force_N = glm::length(record.F_hand_W.force_N);
        low_N = std::min(low_N, force_N), high_N = std::max(high_N, force_N), sum_N += force_N;
      }
      EXPECT_GT(sum_N / 300, 0.5);
      EXPECT_LT(high_N - low_N, 0.05 * sum_N / 300) << grip.name << " grip, " << round_trip_ticks << " ms";
      EXPECT_EQ(on.loop->faults(), 0u);
    }
  }
}

TEST(TilesPace, SparesWhatWouldBeLateAndRestsLongerEachTime) {
  constexpr double kPeriod_s = 1e-3;
  // Every tick that looks takes 0.9 of its period.
  const auto counted = [](TilesPace& pace, int ticks, bool may_rest) {
    std::array<int, 3> count{};
    TilesPace::Tick last = TilesPace::Tick::kSpared;
    for (int i = 0; i < ticks; ++i) {
      last = pace.next(last == TilesPace::Tick::kLooks ? 0.9 : 0.1, kPeriod_s, may_rest);
      ++count[static_cast<std::size_t>(last)];
    }
    return count;
  };
  TilesPace always;
  EXPECT_EQ(counted(always, 10'000, false)[2], 0);
  EXPECT_NEAR(counted(always, 10'000, false)[0], 5'000, 1);
  TilesPace pace;
  EXPECT_GT(counted(pace, 2'000, true)[2], 1'000);
  EXPECT_GT(counted(pace, 60'000, true)[2], 55'000) << "tries become rare";
  int looks = 0;
  for (int i = 0; i < 100'000; ++i) looks += pace.next(0.3, kPeriod_s, true) == TilesPace::Tick::kLooks;
  EXPECT_GT(looks, 30'000) << "and when they fit, it stays";
}

// Where ticks on tiles do not fit, the remote's fresh contacts are felt for a while; neither way there is a jump.
TEST(TilesInTheLoop, RestWhereTicksTakeTooLongAndComeBack) {
  OnPlates on(kMediumGrip, 2, true);
  for (int i = 0; i < 600; ++i) on.tick();
  double last_N = glm::length(on.tick().F_hand_W.force_N), step_N = 0;
  bool has_rested = false, is_back = false, looked = false;
  for (int i = 0; i < 6'000; ++i) {
    const std::uint64_t spared = on.loop->ticks_spared();
    const TickRecord record = on.tick(i < 1'500 && looked ? 0.9 : 0.1);
    looked = record.rung == 3 && on.loop->ticks_spared() == spared;
    step_N = std::max(step_N, std::abs(glm::length(record.F_hand_W.force_N) - last_N));
    last_N = glm::length(record.F_hand_W.force_N);
    EXPECT_EQ(record.is_resting, record.rung == 1) << "no heights are late here";
    has_rested = has_rested || record.is_resting;
    is_back = has_rested && record.rung == 3;
  }
  EXPECT_TRUE(has_rested);
  EXPECT_TRUE(is_back);
  EXPECT_GT(last_N, 0.5);
  EXPECT_LT(step_N, 0.2);
  EXPECT_EQ(on.loop->faults(), 0u);
}

TEST(TilesInTheLoop, ForceFadesWhileTheRemoteIsSilentAndComesBackWithoutAJump) {
  OnPlates on(kMediumGrip, 20);
  for (int i = 0; i < 600; ++i) on.tick();
  on.remote.is_silent = true;
  TickRecord record;
  double before_N = 0;
  for (int i = 0; i < 500; ++i) record = on.tick();
  EXPECT_EQ(record.state, LoopState::kFading);
  EXPECT_LT(glm::length(record.F_contact_To_W.force_N), 0.05);
  on.remote.is_silent = false;
  before_N = glm::length(record.F_hand_W.force_N);
  double largest_N = 0;
  for (int i = 0; i < 600; ++i) {
    record = on.tick();
    largest_N = std::max(largest_N, std::abs(glm::length(record.F_hand_W.force_N) - before_N));
    before_N = glm::length(record.F_hand_W.force_N);
  }
  EXPECT_EQ(record.state, LoopState::kTouching);
  EXPECT_LT(largest_N, 0.2);
}

}  // namespace
}  // namespace farfeel::master_station
