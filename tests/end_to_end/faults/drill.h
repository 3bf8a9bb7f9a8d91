// A slave process, a road with faults, and a hand that presses all the while: a seeded schedule of faults, and what
// each did. The same seed makes the same faults in the same order, with the same sizes and lengths.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/end_to_end/faults/fault_relay.h"
#include "tests/end_to_end/faults/hand.h"
#include "tests/end_to_end/faults/processes.h"
#include "tests/end_to_end/faults/yardstick.h"

namespace farfeel::end_to_end {

enum class FaultKind : std::uint8_t {
  kPause,            ///< SIGSTOP of the slave
  kRestart,          ///< kill -9 of the slave, and another on its port
  kOtherScene,       ///< the same, with another scene, while long datagrams vanish
  kPartition,        ///< nothing passes
  kHapticPartition,  ///< on the haptic lane
  kBulkPartition,    ///< on the bulk lane
  kOneWayPartition,  ///< what the slave sends does not arrive
  kHapticRebind,     ///< the haptic lane's client has another address
  kBulkRebind,       ///< the bulk lane's
  kBothRebind,       ///< both at once
  kDuplicates,       ///< every third datagram comes twice
  kReorder,          ///< every fifth is overtaken
  kSmallMtu,         ///< datagrams of more than 1200 B vanish
  kRoundTripSteps,   ///< 20 ms, 200 ms and 20 ms again
  kBurstLoss,        ///< a fifth is lost, twenty in a row
  kClockSteps,       ///< the operator's wall clock by 300 s, forth or back
};
inline constexpr std::size_t kFaultKinds = 16;
[[nodiscard]] std::string_view name(FaultKind) noexcept;

/// What became of one fault.
struct FaultOutcome {
  FaultKind kind = FaultKind::kPause;
  double round_trip_ms = 0;  ///< of the road
  double recovery_ms = 0;    ///< from when nothing stood in the way any more to the first new answer
  double most_ms = 0;        ///< that it may take; 0: the fault leaves the lane passable, and any time is right
  double allowance_ms = 0;   ///< what this machine was late meanwhile
  [[nodiscard]] bool is_late() const { return most_ms > 0 && recovery_ms > most_ms + allowance_ms; }
};

class Drill {
 public:
  /// program: this one, which can be a slave, too.
  Drill(std::string program, std::uint64_t seed);
  ~Drill();

  /// Every kind once, in an order of the seed's. patience for a person's eyes: each outcome is told as it comes.
  std::vector<FaultOutcome> run(const std::function<void(const FaultOutcome&)>& tell);
  /// Keys die in a silence of 181 s.
  FaultOutcome let_keys_die();
  [[nodiscard]] Watch& watch() { return watch_; }
  /// Steps of the force while this machine was too late for a road of this kind: told, and no violations.
  [[nodiscard]] std::uint64_t shaken_steps() const { return shaken_steps_; }

 private:
  [[nodiscard]] FaultOutcome make(FaultKind);
  void start_slave();
  void restart_slave(bool with_other_scene);
  void take_other_scene();
  void step_clock();
  void wait_for_witnesses(std::int64_t of_ns);
  void judge_steps();
  void rest(double seconds);
  /// passable_ns: since when nothing stands in the way.
  void recover(FaultOutcome&, std::int64_t passable_ns, double most_ms);
  [[nodiscard]] bool waits_until(double patience_s, const std::function<bool()>& is_so) const;
  double uniform(double low, double high) { return std::uniform_real_distribution<>(low, high)(random_); }

  std::string program_;
  std::mt19937_64 random_;
  Calm calm_;  // before any thread starts
  Yardstick yardstick_;
  Watch watch_;
  std::uint16_t port_ = 0;
  std::uint32_t scene_ = 0;
  std::uint64_t restarts_ = 0, shaken_steps_ = 0;
  std::atomic<std::int64_t> clock_offset_ns_{0};
  double round_trip_ms_ = 0;
  std::unique_ptr<OtherProcess> slave_;
  std::unique_ptr<FaultRelay> relay_;
  std::unique_ptr<master_station::MasterSession> session_;
  std::unique_ptr<Hand> hand_;
};

}  // namespace farfeel::end_to_end
