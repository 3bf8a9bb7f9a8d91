// The whole loop on textured plates whose remote is a round trip away: held still, and through a silence of the remote.
#include <gtest/gtest.h>

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
  explicit OnPlates(const Grip& grip, int round_trip_ticks)
      : remote(plates, round_trip_ticks), device(Rig::device_settings(grip)) {
    plates.send_all(cache);
    device.hold_at(test_support::TiledPlates::pose(0.4e-3, -2e-3));
    HapticLoopSettings settings = Rig::loop_settings(local_model::Rung::kTiles);
    settings.body = {0.02, Eigen::Vector3d(1e-6, 1e-6, 1e-6).asDiagonal()};
    loop = std::make_unique<HapticLoop>(device, remote, settings, &contacts);
    for (int i = 0; i < 400; ++i) tick();  // from where the device starts to over the plate
    device.hold_at(test_support::TiledPlates::pose(0.4e-3, 3 / grip.stiffness_N_per_m));
  }
  TickRecord tick() {
    loop->tick({time_ns, 0, 0, 0});
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
    for (const int round_trip_ticks : {100}) {
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
