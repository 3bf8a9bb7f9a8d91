// A loop on two textured plates is recorded and replayed. The remote answers at once; tiles come in one after the
// other.
#include "master_station/recording/loop_replay.h"

#include <gtest/gtest.h>

#include "codecs/tile/tile_codec.h"
#include "codecs/wire/answer_message.h"
#include "codecs/wire/tile_messages.h"
#include "master_station/recording/tick_recorder.h"
#include "master_station/session/tile_receiver.h"
#include "tests/support/tiled_plates.h"
#include "transport/lane/lane_keys.h"

namespace farfeel::master_station {
namespace {

constexpr int kRecorded = 150, kUnplugged = 80, kReset = 90, kTilesATick = 4;

/// A handle on its way down, which gives no more than 2 N; it is unplugged for a tick.
class Handle final : public Device {
 public:
  Handle() {
    capabilities_.max_force_N = 8, capabilities_.max_torque_Nm = 0.3, capabilities_.max_force_rate_N_per_s = 10'000;
    capabilities_.max_power_W = 10, capabilities_.max_speed_m_s = 2;
    capabilities_.stable_stiffness_N_per_m = 1000, capabilities_.stable_damping_Ns_per_m = 1;
    capabilities_.stable_rotational_stiffness_Nm_per_rad = 5;
    capabilities_.stable_rotational_damping_Nms_per_rad = 0.005;
  }
  [[nodiscard]] const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
  [[nodiscard]] DeviceState read(std::int64_t time_ns) noexcept override {
    const double down = 1e-9 * static_cast<double>(time_ns) / 0.15;
    DeviceState state;
    state.X_BD = test_support::TiledPlates::pose(2e-3 * down, -1e-3 + 4e-3 * down);
    state.is_live = time_ns / 1'000'000 != kUnplugged;
    return state;
  }
  void write(const spatial::Wrench&) noexcept override {}
  [[nodiscard]] spatial::Wrench render(const spatial::Wrench& F_hand_B, const Circumstances&) noexcept override {
    const double force_N = glm::length(F_hand_B.force_N);
    return force_N > 2 ? 2 / force_N * F_hand_B : F_hand_B;
  }

 private:
  DeviceCapabilities capabilities_;
};

class NearRemote final : public Remote {
 public:
  NearRemote(const test_support::TiledPlates& plates, TileReceiver& receiver)
      : service_(plates.remote()), receiver_(receiver), surfaces_{&plates.tool, &plates.table} {}
  void record_by(TickRecorder& recorder) { recorder_ = &recorder; }

  void send(const ToolState& tool) noexcept override {
    codecs::PoseMessage pose;
    pose.sequence = tool.sequence, pose.time_us = tool.time_ns / 1000;
    pose.X_WT = tool.X_WT, pose.V_WT_W = tool.V_WT_W;
    std::array<std::byte, transport::kMaxMessageBytes> bytes;
    const std::size_t size = poses_.write(pose, bytes);
    codecs::PoseMessage told;
    (void)codecs::read(std::span(bytes).first(size), poses_.grid(), told);
    codecs::AnswerMessage answer;
    answer.set = service_.answer({told.number, 1000 * told.time_us, told.X_WT, told.V_WT_W});
    answer_.resize(transport::kMaxMessageBytes);
    answer_.resize(writer_.write(answer, told.X_WT, answer_));
    receiver_.put_waiting();
  }
  bool poll(contact::ContactSet& newest) noexcept override {
    for (int i = 0; i < kTilesATick && surface_ < surfaces_.size(); ++i) {
      const std::vector<geometry::HeightTile>& tiles = surfaces_[surface_]->tiles;
      for (const auto& part : codecs::encoded_tile(tile_, tiles[tile_], codecs::kExactly)) {
        std::vector<std::byte> message(transport::kMaxMessageBytes);
        message.resize(codecs::write(codecs::TileMessage{surface_, part}, message));
        recorder_->note(kTileCame, message);
        receiver_.on_tile(message);
      }
      if (++tile_ == tiles.size()) ++surface_, tile_ = 0;
    }
    if (answer_.empty()) return false;
    recorder_->note(kAnswerCame, answer_);
    codecs::AnswerMessage answer;
    if (reader_.read(answer_, poses_, answer) != codecs::Fault::kNone) return false;
    newest = answer.set;
    return true;
  }

 private:
  contact_service::ContactService service_;
  TileReceiver& receiver_;
  std::array<const geometry::HapticSurface*, 2> surfaces_;
  TickRecorder* recorder_ = nullptr;
  std::uint32_t surface_ = 0, tile_ = 0;  // that come next
  std::vector<std::byte> answer_;
  codecs::PoseWriter poses_;
  codecs::AnswerReader reader_;
  codecs::AnswerWriter writer_;
};

struct Session {
  codecs::Numbers settings;
  codecs::FeltAsset asset;
  codecs::Stream ticks;
};

Session recorded() {
  const test_support::TiledPlates plates;
  const penetration::FeltSurface felt_tool(plates.tool), felt_table(plates.table);
  const std::array bodies{
      contact_service::TouchableObject{.felt = &plates.tool, .material = plates.material, .prepared = &felt_tool},
      contact_service::TouchableObject{.felt = &plates.table, .material = plates.material, .prepared = &felt_table}};
  Session session;
  session.asset = codecs::read_felt_asset(codecs::write_felt_asset(bodies, {}).value()).value();
  local_model::TileCache cache(codecs::read_felt_outline(session.asset.outline).value());
  local_model::LocalContacts contacts(cache);
  TileReceiver receiver(cache);
  NearRemote remote(plates, receiver);
  Handle handle;
  TickRecorder recorder(handle);
  remote.record_by(recorder);
  HapticLoopSettings settings;
  settings.local_model.rung = local_model::Rung::kTiles;
  HapticLoop loop(recorder, remote, settings, &contacts);
  for (int i = 0; i < kRecorded; ++i) recorder.tick(loop, {i * 1'000'000, 100 * i, 50'000, 0}, i == kReset);
  session.settings = numbers_of(RecordedLoop{settings, handle.capabilities(), true});
  session.ticks = std::move(recorder.stream());
  return session;
}

/// The first tick that differs, and where; nothing: none does.
std::optional<std::pair<std::size_t, std::string>> first_difference(const Session& session) {
  codecs::NumberReader settings(session.settings.names, session.settings.values);
  auto replay = LoopReplay::begin(settings, session.asset);
  for (std::size_t i = 0; i < session.ticks.records.size(); ++i) {
    const codecs::Record& record = session.ticks.records[i];
    const auto difference = codecs::first_difference(record.outcome, replay->tick(session.ticks, record), 0);
    if (difference) return std::pair{i, difference->field};
  }
  return std::nullopt;
}

double& input(Session& session, int tick, const std::string& name) {
  const auto& names = session.ticks.inputs;
  const auto at = static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  return session.ticks.records.at(static_cast<std::size_t>(tick)).inputs.at(at);
}

TEST(LoopReplay, IsAsItWasRecordedThroughTouchAndFault) {
  Session session = recorded();
  EXPECT_FALSE(first_difference(session));
  EXPECT_EQ(input(session, kReset, "is_reset"), 1);
  EXPECT_EQ(input(session, kUnplugged, "is_live"), 0);
}

TEST(LoopReplay, EveryInputMatters) {
  const auto differs_at = [](auto&& change) {
    Session session = recorded();
    change(session);
    const auto difference = first_difference(session);
    return difference ? static_cast<int>(difference->first) : -1;
  };
  EXPECT_EQ(differs_at([](Session& s) { input(s, 60, "X_BD.p.x") += 1e-6; }), 60);
  EXPECT_EQ(differs_at([](Session& s) { input(s, 60, "V_BD_B.linear_m_s.z") += 3; }), 60);
  EXPECT_EQ(differs_at([](Session& s) { input(s, 60, "wake_ns") += 1000; }), 60);
  EXPECT_EQ(differs_at([](Session& s) { input(s, kUnplugged, "is_live") = 1; }), kUnplugged);
  EXPECT_EQ(differs_at([](Session& s) { input(s, kReset, "is_reset") = 0; }), kReset);
  EXPECT_EQ(differs_at([](Session& s) { input(s, 60, "is_given_as_asked") = 0; }), 60);
  EXPECT_EQ(differs_at([](Session& s) { s.ticks.records[60].messages.clear(); }), 60);
}

TEST(LoopReplay, TilesMatter) {
  Session session = recorded();
  for (codecs::Record& record : session.ticks.records)
    std::erase_if(record.messages, [](const codecs::RecordedMessage& message) { return message.kind == kTileCame; });
  EXPECT_TRUE(first_difference(session));
}

}  // namespace
}  // namespace farfeel::master_station
