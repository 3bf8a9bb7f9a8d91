// The whole tick, in every state it has, allocates nothing, locks nothing and throws nothing.
#include "tests/support/realtime_guard.h"

#include <gtest/gtest.h>

#include <mutex>
#include <vector>

#include "tests/support/tiled_plates.h"
#include "tests/unit/master_station/haptic_loop/rig.h"

namespace farfeel::master_station {
namespace {

using test_support::RealtimeGuard;

class RealtimeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need malloc and pthread_mutex_lock themselves";
  }
};

TEST_F(RealtimeTest, TheGuardSeesWhatItForbids) {
  const auto seen = [](auto&& forbidden) {
    const std::uint64_t before = RealtimeGuard::violations();
    {
      const RealtimeGuard guard;
      forbidden();
    }
    return RealtimeGuard::violations() > before;
  };
  EXPECT_FALSE(seen([] {}));
  EXPECT_TRUE(seen([] { std::vector<int> grown(100); }));
  EXPECT_TRUE(seen([] {
    std::mutex mutex;
    const std::lock_guard lock(mutex);
  }));
  EXPECT_TRUE(seen([] {
    try {
      throw 1;
    } catch (int) {
    }
  }));
}

/// Answers at once and with what the test prepared, without the allocating queue of AnalyticRemote.
class ImmediateRemote final : public Remote {
 public:
  void send(const ToolState& state) noexcept override { sent_ = state; }
  bool poll(contact::ContactSet& newest) noexcept override {
    if (is_silent || sent_.sequence % 2 == 0) return false;
    newest = world.contacts(sent_.X_WT);
    newest.pose_sequence = sent_.sequence;
    newest.pose_time_ns = sent_.time_ns;
    newest.contacts[0].id = sent_.sequence / 50;  // some re-clustering
    if (is_broken) newest.contacts[0].depth_m = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  test_support::AnalyticWorld world;
  bool is_silent = false, is_broken = false;

 private:
  ToolState sent_;
};

TEST_F(RealtimeTest, AWholeTickStaysClearOfAllOfIt) {
  Rig rig(kMediumGrip);
  ImmediateRemote remote;
  remote.world = rig.remote.world;
  HapticLoop loop(rig.device, remote, Rig::loop_settings());
  const std::uint64_t before = RealtimeGuard::violations();
  bool has_been[5] = {};
  TickRecord record;
  for (int i = 0; i < 4000; ++i) {
    remote.is_silent = i > 2000 && i < 2500;
    remote.is_broken = i > 3800;
    {
      const RealtimeGuard guard;
      loop.tick({i * kTick_ns, 0, 0, 0});
    }
    ASSERT_EQ(RealtimeGuard::violations(), before) << RealtimeGuard::first_violation() << " in tick " << i;
    ASSERT_TRUE(loop.records().pop(record));
    has_been[static_cast<int>(record.state)] = true;
  }
  for (bool state : has_been) EXPECT_TRUE(state);
}

/// Answers like ImmediateRemote, from the plates' own contact service.
class PlatesRemote final : public Remote {
 public:
  explicit PlatesRemote(const test_support::TiledPlates& plates) : service_(plates.remote()) {}
  void send(const ToolState& state) noexcept override { sent_ = state; }
  bool poll(contact::ContactSet& newest) noexcept override {
    newest = service_.answer({sent_.sequence, sent_.time_ns, sent_.X_WT, sent_.V_WT_W});
    return true;
  }

 private:
  contact_service::ContactService service_;
  ToolState sent_;
};

TEST_F(RealtimeTest, NorDoesATickThatFeelsTilesAndTakesThemOver) {
  const test_support::TiledPlates plates;
  local_model::TileCache cache(plates.outline());
  local_model::LocalContacts contacts(cache);
  SimulatedDevice device(Rig::device_settings(kMediumGrip));
  spatial::Pose X_WHand = test_support::TiledPlates::pose(0, 0.5e-3);
  device.hold_at(X_WHand);
  PlatesRemote remote(plates);
  HapticLoop loop(device, remote, Rig::loop_settings(local_model::Rung::kTiles), &contacts);
  const std::uint64_t before = RealtimeGuard::violations();
  bool has_felt[4] = {};
  TickRecord record;
  for (int i = 0; i < 600; ++i) {
    const auto tile = static_cast<std::uint32_t>(i - 100);
    if (i >= 100 && tile < plates.table.tiles.size()) (void)cache.put({1, tile}, plates.table.tiles[tile]);
    if (i >= 100 && tile < plates.tool.tiles.size()) (void)cache.put({0, tile}, plates.tool.tiles[tile]);
    {
      const RealtimeGuard guard;
      loop.tick({i * kTick_ns, 0, i == 500 ? 2 * kTick_ns : 0, 0});
    }
    ASSERT_EQ(RealtimeGuard::violations(), before) << RealtimeGuard::first_violation() << " in tick " << i;
    ASSERT_TRUE(loop.records().pop(record));
    has_felt[record.rung] = true;
  }
  EXPECT_TRUE(has_felt[1] && has_felt[3]);
  EXPECT_GT(glm::length(record.F_hand_W.force_N), 0.1);
  EXPECT_EQ(loop.ticks_spared(), 1u);
  EXPECT_EQ(loop.faults(), 0u);
}

}  // namespace
}  // namespace farfeel::master_station
