#include "master_station/recording/loop_replay.h"

#include <optional>

#include "codecs/felt/felt_outline.h"
#include "codecs/wire/answer_message.h"
#include "haptic_core/local_model/local_contacts.h"
#include "master_station/session/tile_receiver.h"
#include "transport/lane/lane_keys.h"

namespace farfeel::master_station {
namespace {

class RecordedDevice final : public Device {
 public:
  explicit RecordedDevice(const DeviceCapabilities& capabilities) : capabilities_(capabilities) {}
  void go_to(const TickInputs& inputs) { inputs_ = inputs; }

  [[nodiscard]] const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
  [[nodiscard]] DeviceState read(std::int64_t /*time_ns*/) noexcept override { return inputs_.device; }
  void write(const spatial::Wrench& /*F_hand_B*/) noexcept override {}
  [[nodiscard]] spatial::Wrench render(const spatial::Wrench& F_hand_B, const Circumstances&) noexcept override {
    return inputs_.is_given_as_asked ? F_hand_B : inputs_.F_given_B;
  }
  [[nodiscard]] double masked_torque_Nm() const noexcept override { return inputs_.masked_torque_Nm; }
  [[nodiscard]] double hand_energy_J() const noexcept override { return inputs_.hand_energy_J; }

 private:
  DeviceCapabilities capabilities_;
  TickInputs inputs_;
};

/// Every pose goes up, as far as the reader of answers knows; what came down is the record's.
class RecordedRemote final : public Remote {
 public:
  void receive_by(TileReceiver& receiver) { receiver_ = &receiver; }
  void go_to(const codecs::Record& record) { record_ = &record; }

  void send(const ToolState& tool) noexcept override {
    codecs::PoseMessage pose;
    pose.sequence = tool.sequence;
    pose.time_us = tool.time_ns / 1000;
    pose.X_WT = tool.X_WT;
    pose.V_WT_W = tool.V_WT_W;
    std::array<std::byte, transport::kMaxMessageBytes> bytes;
    (void)poses_.write(pose, bytes);
    if (receiver_) receiver_->put_waiting();
  }
  bool poll(contact::ContactSet& newest) noexcept override {
    bool has_any = false;
    for (const codecs::RecordedMessage& message : record_->messages) {
      if (message.kind == kTileCame && receiver_) receiver_->on_tile(message.bytes);
      if (message.kind != kAnswerCame || answers_.read(message.bytes, poses_, answer_) != codecs::Fault::kNone)
        continue;
      has_any = true;
      newest = answer_.set;
    }
    return has_any;
  }

 private:
  const codecs::Record* record_ = nullptr;
  TileReceiver* receiver_ = nullptr;
  codecs::PoseWriter poses_;
  codecs::AnswerReader answers_;
  codecs::AnswerMessage answer_;
};

}  // namespace

class LoopReplay::State {
 public:
  State(const RecordedLoop& recorded, contact_service::FeltScene scene)
      : device_(recorded.capabilities), moving_(recorded.settings.moving) {
    if (recorded.has_outline) {
      for (const motion::MovingObject& moving : recorded.settings.moving)
        if (moving.object + 1 < scene.bodies.size()) scene.bodies[moving.object + 1].motion = moving.script;
      cache_.emplace(std::move(scene));
      contacts_.emplace(*cache_);
      remote_.receive_by(receiver_.emplace(*cache_));
    }
    loop_.emplace(device_, remote_, recorded.settings, contacts_ ? &*contacts_ : nullptr);
  }

  [[nodiscard]] codecs::Outputs tick(const codecs::Stream& stream, const codecs::Record& record) {
    const TickInputs inputs = inputs_in(stream, record);
    device_.go_to(inputs);
    remote_.go_to(record);
    if (inputs.is_reset) loop_->reset_fault();
    loop_->tick(inputs.timing);
    return outputs_of(*loop_);
  }
  [[nodiscard]] std::span<const motion::MovingObject> moving() const { return moving_; }

 private:
  RecordedDevice device_;
  std::vector<motion::MovingObject> moving_;
  RecordedRemote remote_;
  std::optional<local_model::TileCache> cache_;
  std::optional<local_model::LocalContacts> contacts_;
  std::optional<TileReceiver> receiver_;
  std::optional<HapticLoop> loop_;
};

LoopReplay::LoopReplay(std::unique_ptr<State> state) : state_(std::move(state)) {}
LoopReplay::LoopReplay(LoopReplay&&) noexcept = default;
LoopReplay::~LoopReplay() = default;

tl::expected<LoopReplay, std::string> LoopReplay::begin(codecs::NumberReader& settings,
                                                        const codecs::FeltAsset& asset) {
  const auto loop = loop_in(settings);
  if (!loop) return tl::unexpected(loop.error());
  auto scene = codecs::read_felt_outline(asset.outline);
  if (!scene) return tl::unexpected(scene.error());
  return LoopReplay(std::make_unique<State>(*loop, *std::move(scene)));
}

std::span<const motion::MovingObject> LoopReplay::moving() const {
  return state_->moving();
}

codecs::Outputs LoopReplay::tick(const codecs::Stream& stream, const codecs::Record& record) {
  return state_->tick(stream, record);
}

}  // namespace farfeel::master_station
