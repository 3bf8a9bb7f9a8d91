// One tick: device in, newest contacts in, local model, tool, wrench out, tool's pose out. It never waits for anybody.
//
//   device ⇄ gear ⇄ virtual coupling ⇄ tool ⇄ local model ⇠ remote
//
// Time is an argument of tick(): tests need no clock and no sleep. run() is the same tick on a periodic loop.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

#include "haptic_core/constraint/tool_step.h"
#include "haptic_core/local_model/local_model.h"
#include "haptic_core/passivity/port_observer.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "haptic_core/realtime/spsc_queue.h"
#include "haptic_core/teleoperation/handle_end.h"
#include "haptic_core/tool/rigid_tool.h"
#include "haptic_core/tool/virtual_coupling.h"
#include "master_station/devices/device.h"
#include "master_station/haptic_loop/fault.h"
#include "master_station/haptic_loop/handle_estimate.h"
#include "master_station/haptic_loop/handle_gear.h"
#include "master_station/haptic_loop/remote.h"
#include "master_station/haptic_loop/tick_record.h"
#include "master_station/haptic_loop/tiles_pace.h"
#include "master_station/haptic_loop/wrench_limiter.h"

namespace farfeel::master_station {

struct HapticLoopSettings {
  realtime::PeriodicSettings timing;
  tool::MassProperties body;  ///< of the asset; simulated with its mass clamped to 1-100 g
  spatial::Pose X_WB;         ///< the device's base in the world [m of the handle]
  spatial::Pose X_TG;         ///< where the handle sits in the tool
  GearScales scales;          ///< of the scene
  local_model::LocalModelSettings local_model;
  bool tiles_may_rest = false;               ///< surfaces felt here: where ticks do not fit and the round trip is short
  std::vector<motion::MovingObject> moving;  ///< of the scene
  tool::Integrator integrator = tool::Integrator::kBackwardEuler;
  /// Other than ours: comparators, which know neither coupling nor local model nor tank.
  teleoperation::Controller controller = teleoperation::Controller::kOurs;
  std::size_t record_capacity = 4096;  ///< ticks that may wait for the recorder
};

/// The stiffest coupling that, felt through the gear, the device states to be stable at this tick, as far as its
/// damping keeps that tool from ringing on it.
[[nodiscard]] tool::CouplingGains coupling_for(const DeviceCapabilities&, const GearScales&,
                                               const tool::MassProperties&, std::int64_t period_ns) noexcept;

class HapticLoop {
 public:
  /// All outlive the loop. Memory is taken here and nowhere else. contacts: what rung 3 feels, and rungs 1 and 2 until
  /// the remote has told of it; null: contacts are felt as they come.
  HapticLoop(Device& device, Remote& remote, const HapticLoopSettings& settings,
             local_model::LocalContacts* contacts = nullptr);

  /// Realtime-safe. Times grow; a gap is a missed tick.
  void tick(const realtime::TickTiming& timing) noexcept;
  /// Ticks until `stop`, on the calling thread.
  void run(const std::atomic<bool>& stop);

  /// For one other thread: the recorder.
  [[nodiscard]] realtime::SpscQueue<TickRecord>& records() noexcept { return records_; }
  /// Any thread: forgets the fault at the next tick; the hand takes hold of the tool where that is, and the force comes
  /// back slowly.
  void reset_fault() noexcept { is_reset_asked_.store(true, std::memory_order_relaxed); }
  /// Any thread. On: the force fades and stays off, the hand holds the tool no longer. Off: as after a reset of a
  /// fault.
  void pause(bool is_on) noexcept { wants_pause_.store(is_on, std::memory_order_relaxed); }
  [[nodiscard]] bool is_paused() const noexcept { return wants_pause_.load(std::memory_order_relaxed); }
  /// Any thread. While paused: the tool goes back to where it began, as far as surfaces let it. There the hand takes
  /// hold of it in the end, wherever the handle is then. Does nothing while not paused.
  void recentre() noexcept { is_recentre_asked_.store(is_paused(), std::memory_order_relaxed); }
  /// Any thread.
  [[nodiscard]] Fault fault() const noexcept { return fault_.load(std::memory_order_relaxed); }
  [[nodiscard]] LoopState state() const noexcept { return state_.load(std::memory_order_relaxed); }

  // When the loop does not run:
  [[nodiscard]] const realtime::PeriodicStatistics& statistics() const noexcept { return statistics_; }
  [[nodiscard]] const local_model::LocalModel& local_model() const noexcept { return local_model_; }
  [[nodiscard]] const tool::RigidTool& tool() const noexcept { return touching_.tool; }
  /// Where depths belong, and what the remote gets: of rows the proxy, which stays on the surface; else the tool's
  /// pose.
  [[nodiscard]] const spatial::Pose& X_WP() const noexcept { return touching_.X_WP; }
  [[nodiscard]] std::uint64_t sets_out_of_order() const noexcept { return sets_out_of_order_; }
  [[nodiscard]] std::uint64_t faults() const noexcept { return faults_; }
  /// Ticks that felt the tiles as linearised in the tick before, because that one took too long.
  [[nodiscard]] std::uint64_t ticks_spared() const noexcept { return ticks_spared_; }

 private:
  /// Scene time begins with the first tick.
  [[nodiscard]] std::int64_t scene_ns(std::int64_t now_ns) const noexcept { return now_ns - start_ns_; }
  void latch(Fault) noexcept;
  void forget_fault() noexcept;
  [[nodiscard]] bool obey() noexcept;  ///< what was asked for; whether the hand is to take hold of the tool anew
  void read_device(std::int64_t time_ns, double dt_s) noexcept;
  void take_courses(double scene_s) noexcept;
  void receive(std::int64_t now_ns, TickRecord& record) noexcept;
  void feel_surfaces(const realtime::TickTiming&, double dt_s, TickRecord& record) noexcept;
  [[nodiscard]] spatial::Wrench render_local_model(double dt_s, TickRecord& record) noexcept;
  local_model::Felt press_springs(double dt_s, TickRecord& record) noexcept;
  local_model::Felt press_pad(double dt_s, TickRecord& record) noexcept;
  [[nodiscard]] bool is_tool_sane() noexcept;  ///< else a fault, and the tool is put where the hand is
  [[nodiscard]] spatial::Wrench render_line(double dt_s, TickRecord& record) noexcept;
  [[nodiscard]] LoopState next_state(std::uint32_t pressing, double dt_s) noexcept;
  [[nodiscard]] bool is_settling() const noexcept;
  [[nodiscard]] double pull_on_hand_N() const noexcept;  ///< of the coupling, if it pulled now

  Device& device_;
  Remote& remote_;
  local_model::LocalContacts* contacts_;
  TilesPace pace_;
  double round_trip_ms_ = 0;  // a mean over the last answers
  std::uint8_t rung_felt_ = 0;
  std::uint64_t ticks_spared_ = 0;
  HapticLoopSettings settings_;
  HandleEstimate handle_;
  HandleGear gear_;
  tool::VirtualCoupling coupling_;
  motion::MovingObjects moving_;
  local_model::LocalModel local_model_;
  WrenchLimiter limiter_;
  std::optional<teleoperation::HandleEnd> line_end_;  // of a controller other than ours
  teleoperation::LineValue line_out_;
  constraint::TouchingTool touching_;  // without rows the proxy is the tool
  spatial::Pose X_WD_;
  spatial::Twist V_WD_W_;
  bool is_clutch_held_ = false;
  contact::ContactSet newest_;

  bool has_started_ = false;
  bool is_handle_known_ = false;  // X_WD_ was read, so a jump from it can be told
  bool is_placed_ = false;        // the tool has been put where the handle was first read
  bool was_enabled_ = false, takes_hold_ = false;
  double wanted_N_ = 0, script_work_told_J_ = 0;
  std::int64_t start_ns_ = 0, last_ns_ = 0;
  std::uint32_t sequence_ = 0;
  bool has_answer_ = false;
  std::uint32_t answered_sequence_ = 0;
  std::uint64_t ticks_ = 0;
  std::uint64_t sets_out_of_order_ = 0, faults_ = 0, contacts_lost_ = 0;
  double untouched_s_ = 0, fresh_s_ = 0;
  bool returns_ = false;  // the remote was silent until its force had faded, and is not fresh for long yet
  std::atomic<LoopState> state_{LoopState::kFading};
  std::atomic<Fault> fault_{Fault::kNone};
  bool is_paused_ = false, is_recentring_ = false;
  spatial::Pose X_WI_start_;
  std::atomic<bool> is_reset_asked_{false}, wants_pause_{false}, is_recentre_asked_{false};
  realtime::SpscQueue<TickRecord> records_;
  realtime::PeriodicStatistics statistics_;
};

}  // namespace farfeel::master_station
