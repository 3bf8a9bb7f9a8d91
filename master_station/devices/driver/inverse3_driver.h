// Haply's Inverse3, with a VerseGrip where there is one, through the maker's service on this machine:
// codecs/device/inverse3.h says what is known of it from where. It never met a device.
//
// The service says where the arm is once for each message that it gets, so each step sends a force, zero or not, and
// waits for the answer. The arm tells the position of the handle's tip, the grip its orientation and buttons: a, b, c
// are buttons 0, 1, 2. Their frame is B as it is. The origin is where the service has it: the arm's base, unless a
// person set another there.
//
// An answer that is missing for kSilence_ns, or that cannot be, takes force off at once; it comes back with a command
// that had none before it. An arm that is not told of any more is gone.
#pragma once

#include <array>

#include "codecs/device/inverse3.h"
#include "master_station/devices/channel/websocket_channel.h"
#include "master_station/devices/driver/driver.h"
#include "master_station/devices/driver/velocity_estimate.h"

namespace farfeel::devices {

extern const DriverFamily kInverse3Family;

class Inverse3Driver final : public Driver {
 public:
  static constexpr std::int64_t kSilence_ns = 20'000'000;
  static constexpr double kMaxForce_N = 10;  ///< of model/inverse3.toml

  /// identity.serial is the service's device_id. Waits for the service's list of devices, mostly some ms, and fails
  /// where none comes or the device is not in it.
  [[nodiscard]] static tl::expected<std::unique_ptr<Driver>, DeviceError> open(std::unique_ptr<TextChannel> channel,
                                                                               FoundDevice identity,
                                                                               std::int64_t silence_ns = kSilence_ns);
  ~Inverse3Driver() override;

  [[nodiscard]] const FoundDevice& identity() const noexcept override { return identity_; }
  Stage step(std::int64_t deadline_ns, const Command& command, Sample& newest) override;
  [[nodiscard]] std::string advice() const override;
  [[nodiscard]] std::string model_toml() const override;
  [[nodiscard]] std::optional<ZeroForce> zero_force() const override;

 private:
  Inverse3Driver(std::unique_ptr<TextChannel> channel, FoundDevice identity, std::int64_t silence_ns);
  void send(const glm::dvec3& force_B_N, std::int64_t now_ns) noexcept;
  void hear(std::int64_t deadline_ns) noexcept;
  void take(std::string_view text, std::int64_t now_ns) noexcept;
  [[nodiscard]] bool take_grip(const codecs::Inverse3Update& update, std::int64_t now_ns) noexcept;
  void fault(const char* why) noexcept;

  std::unique_ptr<TextChannel> channel_;
  FoundDevice identity_;
  std::int64_t silence_ns_;
  Stage stage_ = Stage::kOpening;
  const char* why_ = nullptr;                                     ///< not kReady
  bool is_force_to_wait_ = false;                                 ///< for a command without force
  bool is_begun_ = false, has_grip_ = false, is_turned_ = false;  ///< the service told its devices; a grip among them
  std::int64_t sent_ns_ = 0, grip_ns_ = 0;
  std::uint64_t messages_at_send_ = 0;
  codecs::Inverse3Id grip_;
  Sample newest_;
  VelocityEstimate velocity_;
  std::array<char, codecs::kInverse3CommandMax> text_{};
};

}  // namespace farfeel::devices
