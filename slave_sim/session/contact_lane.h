// The slave's end of the haptic lane: the newest pose in, its contacts out. One thread, which owns the lane's socket.
//
// The thread sleeps in the socket. When poses wait there it takes them all, answers the newest and sends the answer
// from where it stands: nothing is queued, and no second thread has to be woken on the way.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <stop_token>

#include "codecs/wire/haptic_messages.h"
#include "haptic_core/realtime/histogram.h"
#include "haptic_core/realtime/latest_value.h"
#include "haptic_core/realtime/spsc_queue.h"
#include "haptic_core/teleoperation/remote_end.h"
#include "slave_sim/session/contact_source.h"
#include "transport/sequence_window.h"
#include "transport/udp_socket.h"

namespace farfeel::slave_sim {

class ContactLane {
 public:
  /// What the io thread tells the contact thread.
  struct Session {
    std::uint32_t id = 0;        ///< 0: there is none
    transport::Address control;  ///< poses must come from this host
  };
  /// What the contact thread tells the io thread, over the live session.
  struct Report {
    std::uint32_t session = 0;
    transport::LaneCounters poses;
    std::uint64_t malformed = 0, answered = 0, sent = 0, left_out = 0;
    std::int64_t first_answer_ns = 0, last_answer_ns = 0;
    realtime::Histogram answer_time;
  };

  /// body: of the tool, for masters that let it be simulated here.
  ContactLane(transport::UdpSocket socket, ContactSource& contacts, const tool::MassProperties& body);

  /// The contact thread's whole life.
  void run(const std::stop_token&);

  /// One other thread. Wait-free; false: the contact thread has not caught up, try again.
  [[nodiscard]] bool edit(const SurfaceEdit& edit) noexcept { return edits_.push(edit); }

  // Called by the io thread. Wait-free.
  void set_session(const Session& session) noexcept { session_.store(session); }
  [[nodiscard]] const Report& report() noexcept;
  /// The live session's newest answered pose, at the place where its contacts were looked up, once there is one newer
  /// than the last call's.
  [[nodiscard]] const contact_service::ToolPose* newest_look() noexcept {
    return newest_look_.refresh() ? &newest_look_.latest() : nullptr;
  }
  /// When the live session's last good pose arrived; 0 before any.
  [[nodiscard]] std::int64_t heard_ns() const noexcept { return heard_ns_.load(std::memory_order_relaxed); }
  /// Of the soft maxima in the last answer, the widest [m].
  [[nodiscard]] double widest_m() const noexcept { return widest_m_.load(std::memory_order_relaxed); }

 private:
  void adopt_session();
  void take_edits() noexcept;
  bool take_newest_pose();
  bool accept(const transport::Received&);
  void answer();
  void answer_line();

  transport::UdpSocket socket_;
  ContactSource& contacts_;
  tool::MassProperties body_;
  realtime::LatestValue<Session> session_;
  realtime::LatestValue<contact_service::ToolPose> newest_look_;
  realtime::LatestValue<Report> published_;
  std::atomic<std::int64_t> heard_ns_{0};
  std::atomic<double> widest_m_{0};
  realtime::SpscQueue<SurfaceEdit> edits_;

  // The contact thread's own.
  Session live_;
  transport::Address peer_;
  bool has_peer_ = false;
  transport::SequenceWindow window_;
  std::uint32_t sequence_ = 0;
  codecs::PoseSample pose_;
  std::int64_t pose_arrival_ns_ = 0;
  codecs::ContactAnswer answer_;
  std::optional<teleoperation::RemoteEnd> line_;  // while a master wants the tool simulated here
  teleoperation::Controller line_controller_ = teleoperation::Controller::kOurs;
  std::int64_t line_time_ns_ = 0;
  Report report_;
  std::int64_t published_ns_ = 0;
};

}  // namespace farfeel::slave_sim
