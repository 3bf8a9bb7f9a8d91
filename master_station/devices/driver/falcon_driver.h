// Novint Falcon: three degrees of force and position, USB 0403:cb48.
//
//     opening --reply--> homing --moved out and in--> ready <--replies again-- fault
//        |                 ^                            |                        ^
//        +--no reply--> firmware --loaded               +----- 20 ms silent -----+
//
// It speaks when spoken to: one packet out, one in. The firmware is Novint's, may not be shipped with this program, and
// stays in the device while it has power. Lights: red while homing or at fault, blue when ready, green while force is
// on. Base frame B: codecs/device/falcon_kinematics.h's F, turned (x to the right, y away from the person, z up), with
// its origin in the middle of the workspace.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "codecs/device/falcon.h"
#include "codecs/device/falcon_kinematics.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/channel/channel.h"
#include "master_station/devices/driver/driver.h"
#include "master_station/devices/driver/falcon_loader.h"
#include "master_station/devices/driver/velocity_estimate.h"

namespace farfeel::devices {

extern const DriverFamily kFalconFamily;

/// What went wrong with replies since the device was opened, for tests and for a person who looks for the reason.
struct FalconCounts {
  std::uint64_t readings = 0, discarded_bytes = 0, implausible = 0, stalls = 0, faults = 0;
  std::uint64_t refused_forces = 0;  ///< asked for where the arms cannot give one, or not finite
  std::uint64_t weaker_forces = 0;   ///< more than the motors can, given in the same direction
};

class FalconDriver final : public Driver {
 public:
  using Clock = std::function<std::int64_t()>;

  /// firmware: empty, or the bytes of a good file. Tests give a clock of their own.
  FalconDriver(FoundDevice found, std::unique_ptr<UsbChannel> channel, std::vector<std::byte> firmware,
               Clock clock = realtime::monotonic_now_ns);
  ~FalconDriver() override;

  [[nodiscard]] const FoundDevice& identity() const noexcept override { return found_; }
  Stage step(std::int64_t deadline_ns, const Command& command, Sample& newest) override;
  [[nodiscard]] std::string advice() const override;
  /// From homing on: before, sixteen bytes would end up in the boot loader.
  [[nodiscard]] std::optional<ZeroForce> zero_force() const override;

  [[nodiscard]] FalconCounts counts() const noexcept;

 private:
  enum class Phase : std::uint8_t { kSetUp, kProbe, kLoad, kNeedsFile, kHoming, kReady, kFault, kGone };
  void enter(Phase phase, std::int64_t now_ns) noexcept;
  void fault(std::string_view trouble, std::int64_t now_ns) noexcept;
  void set_up(std::int64_t now_ns) noexcept;
  void load(std::int64_t now_ns, std::int64_t deadline_ns) noexcept;
  void exchange(std::int64_t now_ns, std::int64_t deadline_ns, const Command& command, Sample& newest) noexcept;
  bool listen(std::int64_t until_ns, Sample& newest) noexcept;
  void take(const codecs::FalconReading& reading, std::int64_t now_ns, Sample& newest) noexcept;
  [[nodiscard]] bool is_plausible(const codecs::FalconReading& reading, std::int64_t now_ns) const noexcept;
  void say(std::int64_t now_ns, const Command& command) noexcept;
  [[nodiscard]] codecs::FalconCommand obeyed(const Command& command) noexcept;
  void judge(std::int64_t now_ns) noexcept;
  [[nodiscard]] Stage stage() const noexcept;

  FoundDevice found_;
  std::unique_ptr<UsbChannel> channel_;
  FalconLoader loader_;
  bool has_firmware_ = false;  // a file of it
  bool is_loaded_ = false;     // by us
  Clock clock_;

  Phase phase_ = Phase::kSetUp;
  std::int64_t since_ns_ = 0;  // the phase
  std::size_t request_ = 0;
  std::string_view trouble_;

  codecs::FalconStream stream_;
  codecs::FalconReading reading_;       // the newest that was believed
  std::optional<glm::dmat3> jacobian_;  // at it
  VelocityEstimate velocity_;
  std::int64_t said_ns_ = 0, read_ns_ = 0;
  std::int64_t unanswered_since_ns_ = 0;  // the oldest packet that waits for its answer; 0: none does
  std::int64_t good_since_ns_ = 0;        // replies come without a gap
  int doubted_ = 0, placed_ = 0;          // readings in a row that are not believed; that are, of a homed device
  bool has_reading_ = false;
  FalconCounts counts_;
};

}  // namespace farfeel::devices
