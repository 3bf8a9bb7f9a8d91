// A whole tick of the haptic loop on a device that only plays a path: device read, tiles felt, the tool's step, the
// wrench written, the pose sent. The remote has answered once and is asked nothing.
#include "tests/bench/loop_tick.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

#include "codecs/felt/felt_outline.h"
#include "master_station/haptic_loop/haptic_loop.h"
#include "slave_sim/models/height_plate.h"
#include "tests/bench/strokes.h"

namespace farfeel::bench {
namespace {

using namespace master_station;

constexpr double kPress_m = 0.6e-3;

StrokePath usual_path() {
  return {{{0.1, 0.02, 2}}, -0.01};
}

/// A handle that is where its path says, whatever force is written.
class PlayedDevice final : public Device {
 public:
  explicit PlayedDevice(SevenContacts::Handle handle) : handle_(std::move(handle)) {
    capabilities_ = {.name = "played",
                     .max_force_N = 100,
                     .max_torque_Nm = 10,
                     .max_force_rate_N_per_s = 1e6,
                     .max_power_W = 1e6,
                     .max_speed_m_s = 10,
                     .stable_stiffness_N_per_m = 2000,
                     .stable_damping_Ns_per_m = 1,
                     .stable_rotational_stiffness_Nm_per_rad = 5,
                     .stable_rotational_damping_Nms_per_rad = 0.005};
  }
  [[nodiscard]] const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
  [[nodiscard]] DeviceState read(std::int64_t time_ns) noexcept override {
    DeviceState state;
    state.X_BD = handle_(time_ns);
    return state;
  }
  void write(const spatial::Wrench&) noexcept override {}

 private:
  DeviceCapabilities capabilities_;
  SevenContacts::Handle handle_;
};

/// Answers each pose at once with no contact: alive, and with nothing to say.
class SilentRemote final : public Remote {
 public:
  void send(const ToolState& state) noexcept override { sent_ = state; }
  bool poll(contact::ContactSet& newest) noexcept override {
    newest = {};
    newest.pose_sequence = sent_.sequence;
    newest.pose_time_ns = sent_.time_ns;
    newest.X_WT = sent_.X_WT;
    return sent_.time_ns != 0;
  }

 private:
  ToolState sent_;
};

}  // namespace

struct SevenContacts::State {
  State(const geometry::HapticSurface& table, const geometry::HapticSurface& tool, Handle handle)
      : table_felt(table),
        tool_felt(tool),
        cache(filled(table, tool)),
        local(*cache),
        device(std::move(handle)),
        loop(device, remote, settings(), &local) {}

  [[nodiscard]] std::unique_ptr<local_model::TileCache> filled(const geometry::HapticSurface& table,
                                                               const geometry::HapticSurface& tool) const {
    std::vector<contact_service::TouchableObject> bodies{{&tool, {}, {}, &tool_felt}};
    for (int k = 0; k < 7; ++k) bodies.push_back({&table, {}, {{1, 0, 0, 0}, {0, 0, 1e-5 * k}}, &table_felt});
    auto all = std::make_unique<local_model::TileCache>(
        codecs::read_felt_outline(codecs::write_felt_outline(bodies, {}).value()).value());
    for (std::uint32_t s = 0; s < bodies.size(); ++s) {
      const auto& tiles = bodies[s].felt->tiles;
      for (std::uint32_t tile = 0; tile < tiles.size(); ++tile) {
        (void)all->put({s, tile}, tiles[tile]);
        all->take_arrived(1);
      }
    }
    return all;
  }
  [[nodiscard]] static HapticLoopSettings settings() {
    HapticLoopSettings settings;
    settings.timing.period_ns = kTick_ns;
    settings.X_TG.R = glm::conjugate(glm::dquat{0, 1, 0, 0});  // the tool faces down under an upright handle
    settings.local_model.rung = local_model::Rung::kTiles;
    return settings;
  }

  penetration::FeltSurface table_felt, tool_felt;
  std::unique_ptr<local_model::TileCache> cache;
  local_model::LocalContacts local;
  PlayedDevice device;
  SilentRemote remote;
  HapticLoop loop;
};

SevenContacts::SevenContacts(const geometry::HapticSurface& table, const geometry::HapticSurface& tool, Handle handle)
    : state_(std::make_unique<State>(table, tool, std::move(handle))) {}
SevenContacts::~SevenContacts() = default;

void SevenContacts::tick(int i) {
  state_->loop.tick({i * kTick_ns, 0, 0, 0});
}

TickRecord SevenContacts::last_record() {
  TickRecord record;
  state_->loop.records().pop(record);
  return record;
}

geometry::HapticSurface SevenContacts::usual_table() {
  return slave_sim::ridged_plate(1.5e-3, 0.1e-3, {.size_m = {0.040, 0.030, 0.004}, .texel_m = 1e-4});
}

geometry::HapticSurface SevenContacts::usual_tool() {
  return slave_sim::ridged_plate(0.012, 0.3e-3, {.size_m = {0.0064, 0.0064, 0.004}});
}

SevenContacts::Handle SevenContacts::usual_handle() {
  return [path = usual_path()](std::int64_t time_ns) {
    const double t_s = 1e-9 * static_cast<double>(time_ns);
    return spatial::Pose{{1, 0, 0, 0}, {path.at_m(std::fmod(t_s, path.length_s())), 0.3e-3, -kPress_m}};
  };
}

double SevenContacts::usual_length_s() {
  return usual_path().length_s();
}

TickTimes time_seven_contacts(int ticks) {
  const geometry::HapticSurface table = SevenContacts::usual_table(), tool = SevenContacts::usual_tool();
  SevenContacts loop(table, tool, SevenContacts::usual_handle());
  std::vector<double> us;
  TickTimes times;
  for (int i = 1; i <= ticks; ++i) {
    const auto began = std::chrono::steady_clock::now();
    loop.tick(i);
    us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - began).count());
    times.contacts = loop.last_record().contacts;
  }
  std::sort(us.begin(), us.end());
  const auto at = [&](double share) {
    return us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))];
  };
  times.p50_us = at(0.5), times.p99_us = at(0.99), times.p99_9_us = at(0.999);
  return times;
}

}  // namespace farfeel::bench
