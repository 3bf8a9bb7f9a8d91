// The slave's end of the haptic lane: the newest pose in, its contacts out. One thread, which owns the lane's socket.
//
// The thread sleeps in the socket. When poses wait there it takes them, opens them, answers the newest and sends the
// answer from where it stands: nothing is queued, and no second thread has to be woken on the way. Where the master is,
// its newest authentic datagram tells: the lane connects its socket there (transport/net/lane_socket.h).
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <stop_token>

#include "codecs/wire/answer_message.h"
#include "codecs/wire/pose_message.h"
#include "haptic_core/realtime/histogram.h"
#include "haptic_core/realtime/latest_value.h"
#include "haptic_core/realtime/spsc_queue.h"
#include "haptic_core/teleoperation/remote_end.h"
#include "slave_sim/session/contact_source.h"
#include "transport/lane/arrival_meter.h"
#include "transport/lane/peer_path.h"
#include "transport/lane/sealed_lane.h"
#include "transport/net/lane_socket.h"
#include "transport/session_server.h"

namespace farfeel::slave_sim {

class ContactLane {
 public:
  /// What the contact thread tells the io thread, over the live session.
  struct Report {
    std::uint32_t session = 0;
    transport::LaneCounters poses;
    std::uint64_t malformed = 0, answered = 0, sent = 0, left_out = 0;
    std::int64_t first_answer_ns = 0, last_answer_ns = 0;
    realtime::Histogram answer_time;
    realtime::Histogram waiting;  ///< of answered poses: in the socket, and for the thread
    transport::ArrivalMeter up;   ///< what the poses' own times tell
    transport::LaneRejects rejects;
    std::uint64_t handshakes = 0, moves = 0;
  };

  /// grid: of the poses on the wire. body: of the tool, for masters that let it be simulated here.
  ContactLane(transport::LaneSocket socket, ContactSource& contacts, const codecs::PoseGrid& grid,
              const tool::MassProperties& body);

  /// The contact thread's whole life.
  void run(const std::stop_token&);

  /// One other thread. Wait-free; false: the contact thread has not caught up, try again.
  [[nodiscard]] bool edit(const SurfaceEdit& edit) noexcept { return edits_.push(edit); }

  // Called by the io thread. Wait-free.
  /// What an object does from a scene time on. False: the contact thread has not caught up, try again.
  [[nodiscard]] bool set_out(const motion::ObjectCourse& told) noexcept { return courses_.push(told); }
  /// Scene time of the newest pose of the live session, and when that arrived; {0, 0} before any.
  struct SceneTime {
    std::int64_t scene_ns = 0, arrived_ns = 0;
  };
  [[nodiscard]] SceneTime scene_time() noexcept {
    (void)scene_time_.refresh();
    return scene_time_.latest();
  }
  /// 0: there is none.
  void set_session(std::uint32_t id) noexcept { session_.store(id, std::memory_order_release); }
  /// Keys of that session. False: the contact thread has not caught up; the master asks again.
  bool give_keys(const transport::HapticGrant& grant) noexcept { return grants_.push(grant); }
  /// For ListeningPort::pass_on.
  [[nodiscard]] std::uint32_t number() const noexcept { return number_; }
  [[nodiscard]] const Report& report() noexcept;
  /// The live session's newest answered pose, at the place where its contacts were looked up, once there is one newer
  /// than the last call's.
  [[nodiscard]] const contact_service::ToolPose* newest_look() noexcept {
    return newest_look_.refresh() ? &newest_look_.latest() : nullptr;
  }
  /// When the live session's last authentic datagram arrived; 0 before any.
  [[nodiscard]] std::int64_t heard_ns() const noexcept { return heard_ns_.load(std::memory_order_relaxed); }
  /// All that this end has sent, over all sessions, with the IP and UDP headers.
  [[nodiscard]] std::uint64_t sent_bytes() const noexcept { return sent_bytes_.load(std::memory_order_relaxed); }
  /// Of the soft maxima in the last answer, the widest [m].
  [[nodiscard]] double widest_m() const noexcept { return widest_m_.load(std::memory_order_relaxed); }

 private:
  void adopt_session();
  void begin_session(std::uint32_t id);
  void take_edits() noexcept;
  void take_poses();
  void accept(const transport::Received&, std::span<std::byte> bytes);
  void take_pose(std::span<const std::byte> payload, bool is_newest, std::int64_t arrival_ns);
  [[nodiscard]] bool may_answer(std::int64_t now_ns) const;
  void prove_master();
  std::size_t send(transport::MessageType, std::span<const std::byte> message, std::span<std::byte> datagram);
  void answer();
  const contact_service::Answer& answer_line();

  transport::LaneSocket socket_;
  const std::uint32_t number_;
  ContactSource& contacts_;
  tool::MassProperties body_;
  std::atomic<std::uint32_t> session_{0};
  static constexpr std::size_t kQueuedGrants = 8;
  realtime::SpscQueue<transport::HapticGrant> grants_{kQueuedGrants};
  realtime::LatestValue<contact_service::ToolPose> newest_look_;
  realtime::LatestValue<Report> published_;
  std::atomic<std::int64_t> heard_ns_{0};
  std::atomic<std::uint64_t> sent_bytes_{0};
  std::atomic<double> widest_m_{0};
  realtime::SpscQueue<SurfaceEdit> edits_;
  static constexpr std::size_t kQueuedCourses = 512;  // all objects of a scene, twice
  realtime::SpscQueue<motion::ObjectCourse> courses_{kQueuedCourses};
  realtime::LatestValue<SceneTime> scene_time_;

  // The contact thread's own.
  std::uint32_t live_ = 0;
  transport::SealedLane lane_{transport::SealedLane::Role::kResponder};
  transport::PeerPath path_;
  const codecs::PoseGrid grid_;
  codecs::PoseMessage pose_;
  std::int64_t pose_arrival_ns_ = 0;
  bool is_owed_ = false;             // pose_ is not answered yet
  std::int64_t next_answer_ns_ = 0;  // answers are no denser than kAnswerPeriod_ns on average
  codecs::AnswerMessage answer_;
  codecs::AnswerWriter answers_;
  std::optional<teleoperation::RemoteEnd> line_;  // while a master wants the tool simulated here
  std::int64_t line_time_ns_ = 0;
  Report report_;
  std::int64_t published_ns_ = 0;
};

}  // namespace farfeel::slave_sim
