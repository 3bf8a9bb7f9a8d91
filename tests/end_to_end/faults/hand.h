// A hand that presses on the slave's plane through the haptic loop, on a thread of its own, and a look at every tick:
//  - the force on the hand makes no step above kMostStep_N from one tick to the next, beyond what the hand makes itself
//    as it moves against the coupling's spring, per tick's time that passed;
//  - contacts that are older than kOldest_s push nothing;
//  - answers come in the order of their poses, tell the plane of the run that is there, and never again one before it;
//  - tiles hold what their version says, of the run that is there, and their versions never go back.
#pragma once

#include <atomic>
#include <memory>
#include <thread>

#include "master_station/devices/simulated_device.h"
#include "master_station/haptic_loop/haptic_loop.h"
#include "master_station/session/master_session.h"
#include "tests/end_to_end/faults/watch.h"

namespace farfeel::end_to_end {

/// Force that returns after a silence rises by 200 N/s (wrench_limiter.h): 0.2 N in a tick, and what rounding adds
/// where it rises just so.
inline constexpr double kMostStep_N = 0.2 * (1 + 1e-9);
/// 0.2 s that the road takes at most, 0.25 s until the force fades, 0.3 s in which it does, and as much again for a
/// machine that is late.
inline constexpr double kOldest_s = 1.0;

/// Where the tool is, about, while the hand presses.
[[nodiscard]] spatial::Pose where_pressed();

class Hand {
 public:
  /// Both outlive it. The session's scene is adopted.
  Hand(master_station::MasterSession& session, Watch& watch);
  ~Hand();
  Hand(const Hand&) = delete;
  Hand& operator=(const Hand&) = delete;

 private:
  class Pressing;
  class WatchedRemote;
  void tick(const realtime::TickTiming&);
  void look_at_tiles();

  master_station::MasterSession& session_;
  Watch& watch_;
  std::unique_ptr<Pressing> device_;
  std::unique_ptr<WatchedRemote> remote_;
  std::unique_ptr<master_station::HapticLoop> loop_;
  [[nodiscard]] double step_N(const master_station::TickRecord&) const;

  std::int64_t began_ns_ = 0, ticks_ = 0;  // of the tick before
  double spring_N_per_m_ = 0;              // of the coupling
  glm::dvec3 last_force_N_{0}, last_handle_m_{0};
  master_station::LoopState last_state_ = master_station::LoopState::kFree;
  struct Told {
    std::uint32_t run_told = 0, version = 0;  // run modulo kRunsTold
  };
  std::vector<Told> told_;  // of each tile
  std::atomic<bool> is_over_{false};
  std::thread thread_;  // last
};

}  // namespace farfeel::end_to_end
