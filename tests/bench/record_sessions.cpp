// Records the sessions that later builds replay. Nothing in them is left to chance: time is the tick's number, the link
// draws from a seed, and late ticks are told to be late.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <memory>
#include <random>

#include "deploy/replay/session_replay.h"
#include "haptic_core/penetration/historical/historical.h"
#include "master_station/devices/simulated_device.h"
#include "master_station/recording/tick_recorder.h"
#include "slave_sim/recording/answer_replay.h"
#include "tests/bench/bench.h"
#include "tests/bench/recorded_sessions.h"
#include "tests/bench/remote_across_link.h"

namespace farfeel::bench {
namespace {

using namespace master_station;
using contact_service::ContactOptions;
using contact_service::TouchableObject;

template <typename T>
T value_or_stop(tl::expected<T, std::string> expected) {
  if (!expected) throw CLI::RuntimeError(expected.error(), 1);
  return *std::move(expected);
}

ContactOptions options_of(const SessionToRecord& session) {
  ContactOptions options{.tolerance_m = session.tolerance_m,
                         .most_stiffness_N_per_m = contact_service::kHeldStiffness_N_per_m};
  if (session.is_historical) options.maker = penetration::historical::historical_maker();
  return options;
}

/// As a replay will read it: what is recorded runs on the very bytes.
std::vector<std::byte> asset_of(const SessionToRecord& session, const ContactOptions& options) {
  const auto bytes_of = [&options](std::span<const TouchableObject> bodies) {
    return value_or_stop(codecs::write_felt_asset(bodies, options));
  };
  std::deque<penetration::FeltSurface> felt;
  std::vector<TouchableObject> bodies;
  for (const SessionBody& body : session.bodies)
    bodies.push_back({&body.surface, body.material, body.X_WO, &felt.emplace_back(body.surface)});
  const std::vector<std::byte> bytes = bytes_of(bodies);
  const slave_sim::RecordedScene again(value_or_stop(codecs::read_felt_asset(bytes)).scene, {});
  if (bytes_of(again.bodies()) != bytes) throw CLI::RuntimeError(session.name + ": its asset reads otherwise", 1);
  return bytes;
}

std::vector<motion::MovingObject> moving_in(const SessionToRecord& session) {
  std::vector<motion::MovingObject> moving;
  for (std::uint32_t i = 1; i < session.bodies.size(); ++i)
    if (session.bodies[i].motion) moving.push_back({i - 1, *session.bodies[i].motion});
  return moving;
}

HapticLoopSettings loop_of(const SessionToRecord& session) {
  HapticLoopSettings settings;
  settings.timing.period_ns = session.tick_ns;
  settings.body = session.body;
  settings.local_model.rung = session.rung;
  settings.tiles_may_rest = session.late_share > 0;
  settings.moving = moving_in(session);
  settings.integrator = session.integrator;
  settings.controller = session.controller;
  return settings;
}

/// Its plug may be out for a while.
class PluggedDevice final : public SimulatedDevice {
 public:
  using SimulatedDevice::SimulatedDevice;
  [[nodiscard]] DeviceState read(std::int64_t time_ns) noexcept override {
    DeviceState state = SimulatedDevice::read(time_ns);
    state.is_live = is_plugged;
    return state;
  }
  bool is_plugged = true;
};

class Recorders final : public RemoteWatch {
 public:
  explicit Recorders(Device& device) : ticks(device) {}
  void on_answer(std::span<const std::byte> payload) override { ticks.note(kAnswerCame, payload); }
  void on_tile(std::span<const std::byte> payload) override { ticks.note(kTileCame, payload); }
  void on_answered(const contact_service::ToolPose& asked, const contact_service::Answer& answer) override {
    answers.note(asked, answer);
  }
  TickRecorder ticks;
  slave_sim::AnswerRecorder answers;
};

/// A tile of the first object, lower from now on.
slave_sim::SurfaceEdit edit_of(const TouchableObject& object, std::uint32_t tile) {
  slave_sim::SurfaceEdit edit{{1, tile}, object.felt->tiles[tile]};
  ++edit.tile.version;
  constexpr std::uint16_t kLower = 40;  // steps of the heights' scale
  for (std::uint16_t& coefficient : edit.tile.coefficients)
    coefficient = static_cast<std::uint16_t>(coefficient < kLower ? 0 : coefficient - kLower);
  return edit;
}

codecs::Recording recorded(const SessionToRecord& session, const std::vector<std::byte>& asset,
                           const ContactOptions& options) {
  const std::vector<motion::MovingObject> moving = moving_in(session);
  slave_sim::RecordedScene scene(value_or_stop(codecs::read_felt_asset(asset)).scene, moving);
  SimulatedDeviceSettings device_settings;
  device_settings.grip = session.grip;
  device_settings.explorer.hints.p_TWork_T = {0, 0, 0};
  PluggedDevice device(device_settings);
  Recorders recorders(device);
  RemoteAcrossLink::Options remote_options = RemoteAcrossLink::options_of(session.rung);
  remote_options.has_outline = remote_options.has_outline && session.has_outline;
  remote_options.edits = &scene.surfaces();
  remote_options.watch = &recorders;
  RemoteAcrossLink remote(scene.bodies(), options, session.link, remote_options);
  HapticLoopSettings settings = loop_of(session);
  settings.X_WB = session.X_start * spatial::inverse(device.true_pose());  // the handle begins where the tool does
  HapticLoop loop(recorders.ticks, remote, settings, remote.contacts());

  std::mt19937 lots(1);
  std::bernoulli_distribution is_late(session.late_share);
  const auto ticks_in = [&session](double s) {
    return static_cast<int>(std::llround(1e9 * s / static_cast<double>(session.tick_ns)));
  };
  const auto is_within = [](double now_s, double from_s, double for_s) {
    return from_s > 0 && now_s >= from_s && now_s < from_s + for_s;
  };
  const int ticks = ticks_in(session.length_s);
  const int reset_at = session.unplugged_at_s > 0 ? ticks_in(session.unplugged_at_s + 2 * session.kUnplugged_s) : -1;
  const double lean_m = session.lean_N / session.grip.stiffness_N_per_m;
  const TouchableObject& object = scene.bodies()[1];
  std::uint32_t edited = 0;
  for (int i = 0; i < ticks; ++i) {
    const double s = static_cast<double>(i) / ticks, now_s = s * session.length_s;
    if (is_within(now_s, session.stalls_at_s, session.kStalled_s)) continue;
    device.is_plugged = !is_within(now_s, session.unplugged_at_s, session.kUnplugged_s);
    spatial::Pose X_WHand = session.X_wanted(s);
    X_WHand.p += s * lean_m * session.push_W;
    device.hold_at(spatial::inverse(settings.X_WB) * X_WHand);
    remote.at(i * session.tick_ns);
    if (session.edits_from_s > 0 && now_s >= session.edits_from_s && edited < object.felt->tiles.size()) {
      const slave_sim::SurfaceEdit edit = edit_of(object, edited++);
      recorders.answers.note(edit);
      remote.edit(edit);
    }
    const std::int64_t work_ns = session.late_share > 0 && is_late(lots) ? 2 * session.tick_ns : session.tick_ns / 10;
    recorders.ticks.tick(loop, {i * session.tick_ns, 0, work_ns, 0}, i == reset_at);
  }
  codecs::Recording recording;
  recording.title = session.name;
  recording.settings = numbers_of(RecordedLoop{settings, device.capabilities(), remote.contacts() != nullptr});
  const codecs::Numbers service = slave_sim::numbers_of({options, session.is_historical});
  recording.settings.names.insert(recording.settings.names.end(), service.names.begin(), service.names.end());
  recording.settings.values.insert(recording.settings.values.end(), service.values.begin(), service.values.end());
  recording.assets = {codecs::hashed(asset)};
  recording.streams = {std::move(recorders.ticks.stream()), std::move(recorders.answers.stream())};
  return recording;
}

/// What a person wants to know of a session, to see that it is worth replaying.
std::string happened(const codecs::Stream& ticks) {
  const auto share = [&ticks](const char* name, auto&& counts) {
    const auto at =
        static_cast<std::size_t>(std::find(ticks.outputs.begin(), ticks.outputs.end(), name) - ticks.outputs.begin());
    double sum = 0;
    for (const codecs::Record& tick : ticks.records) sum += counts(tick.outcome.values.at(at).front()) ? 1 : 0;
    return 100 * sum / static_cast<double>(ticks.records.size());
  };
  const auto is_set = [](double value) { return value > 0; };
  std::size_t tiles = 0;
  for (const codecs::Record& tick : ticks.records)
    for (const codecs::RecordedMessage& message : tick.messages) tiles += message.kind == kTileCame;
  return fmt::format(
      "pressed {:.0f} %, by outline {:.0f} %, at rest {:.0f} %, held or fading {:.0f} %, fault {:.0f} %, {} parts of "
      "tiles",
      share("local model's contacts that press", is_set), share("contacts by outline", is_set),
      share("is_resting", is_set), share("state", [](double state) { return state == 2 || state == 3; }),
      share("fault", is_set), tiles);
}

struct Options {
  std::string folder, only;
};

void record_all(const Options& options) {
  if (const auto held = replay::hold_to_avx2(); !held) throw CLI::RuntimeError(held.error(), 1);
  std::size_t bytes_of_all = 0;
  for (const SessionToRecord& session : sessions_to_record()) {
    if (session.name.find(options.only) == std::string::npos) continue;
    const ContactOptions felt = options_of(session);
    const std::vector<std::byte> asset = asset_of(session, felt);
    codecs::Recording recording = recorded(session, asset, felt);
    recording.made_with = replay::made_here(recording);
    const std::vector<std::byte> bytes = value_or_stop(codecs::write_recording(recording));
    const std::filesystem::path path = std::filesystem::path(options.folder) / (session.name + ".ffrec");
    for (const auto& [where, what] :
         {std::pair{path, &bytes}, {replay::asset_path(path, codecs::hashed(asset)), &asset}}) {
      if (const auto written = replay::write_bytes(where, *what); !written) throw CLI::RuntimeError(written.error(), 1);
    }
    const auto replayed =
        value_or_stop(replay::replay(recording, value_or_stop(codecs::read_felt_asset(asset)), {.keeps_values = true}));
    if (!replayed.difference.empty()) throw CLI::RuntimeError(session.name + ": " + replayed.difference, 1);
    bytes_of_all += bytes.size();
    fmt::print("{:28} {:5} ticks {:5} answers {:7.1f} kB, asset {:7.1f} kB; {}\n", session.name, replayed.ticks,
               replayed.answers, 1e-3 * static_cast<double>(bytes.size()), 1e-3 * static_cast<double>(asset.size()),
               happened(*replayed.anew.find(kTicks)));
  }
  fmt::print("{:.2f} MB without assets\n", 1e-6 * static_cast<double>(bytes_of_all));
}

}  // namespace

void add_record_sessions(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app = bench.add_subcommand("record-sessions", "Records the sessions that `farfeel replay` replays");
  app->add_option("--out", options->folder, "The folder that they are written to")->required();
  app->add_option("--only", options->only, "Sessions whose name contains this");
  app->callback([options] { record_all(*options); });
}

}  // namespace farfeel::bench
