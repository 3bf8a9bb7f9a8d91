// The remote node on the network: listens on one UDP port, serves one master at a time.
//
// Two threads: io listens, runs all handshakes and the bulk lane (transport/session_server.h), contact runs the haptic
// lane (contact_lane.h). Each lane has a socket of its own, connected to where the master is
// (transport/net/listening_port.h). A master that is silent for 2 s frees the session for others; it may come back to
// it while nobody else did. Another one that comes earlier is refused with the reason. Beside it there are side
// sessions, of those who watch the scene or edit it: the io thread's.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/wire/slave_status.h"
#include "slave_sim/session/contact_lane.h"
#include "slave_sim/session/edit_desk.h"
#include "slave_sim/session/object_courses.h"
#include "slave_sim/session/relayed_ports.h"
#include "slave_sim/session/tile_feed.h"
#include "transport/net/listening_port.h"
#include "transport/session_server.h"
#include "transport/status/link_status.h"

namespace farfeel::slave_sim {

class SlaveSession {
 public:
  struct Options {
    transport::Address local;  ///< port 0 takes a free one
    transport::KeyPair own;
    std::optional<transport::RelayAccess> relay;  ///< a relay that masters may come over, too
    /// Who may in. Called by the io thread.
    transport::HandshakeServer::Find find;
    /// Called four times a second, on the io thread: `find` may answer otherwise afterwards. May be empty.
    std::function<void()> look_at_list;
    /// One line for a person, on the io thread; may be empty.
    std::function<void(const std::string&)> log;
    /// Called four times a second, on the io thread, with all that is known of the link; may be empty.
    std::function<void(const transport::LinkStatus&)> tell_status = {};
    codecs::PoseGrid grid = {};      ///< of the poses on the wire: codecs::grid_around where the tool may go
    tool::MassProperties body = {};  ///< of the tool, for masters that let it be simulated here
  };

  /// What a master gets to feel with between contacts.
  struct Felt {
    std::vector<std::byte> outline;  ///< codecs::write_felt_outline; empty: contacts alone
    TileFeed* tiles = nullptr;       ///< for the io thread alone; outlives the session; null if there is no texture
    std::vector<motion::MovingObject> may_change{};  ///< of the scene, as they are in the beginning
    std::vector<ObjectChange> changed{};             ///< since then
  };

  /// scene: what every master gets first, with the outline (codecs::write_scene). contacts must outlive the session.
  [[nodiscard]] static tl::expected<std::unique_ptr<SlaveSession>, transport::Error> start(
      const Options&, const std::vector<std::byte>& scene, ContactSource& contacts,
      const Felt& felt = {{}, nullptr, {}, {}});
  /// Says goodbye to the master and ends both threads.
  ~SlaveSession();

  SlaveSession(const SlaveSession&) = delete;
  SlaveSession& operator=(const SlaveSession&) = delete;

  [[nodiscard]] const transport::Address& local() const { return local_; }  ///< with the real PORT
  /// A surface changes, now and for all masters to come, who get its new tile in place of the old. Any one thread;
  /// waits while the session's own have not caught up.
  void edit(const SurfaceEdit&);
  /// An object that may change comes, goes or moves, here and at the master at the same scene time, which is so far
  /// ahead that both know it then. Any one thread; waits as edit() does. Of another object it changes nothing.
  void change(const ObjectChange&);
  /// Scene time of the newest pose that came, and what has passed since; nothing without a master. The thread of
  /// change().
  [[nodiscard]] std::optional<double> scene_s() const {
    const std::int64_t scene_ns = scene_ns_.load(std::memory_order_relaxed);
    return has_master() && scene_ns > 0 ? std::optional(1e-9 * static_cast<double>(scene_ns)) : std::nullopt;
  }
  /// The next request to change the scene, waited for so long. The thread of change(), which answers it.
  [[nodiscard]] std::optional<EditQuestion> next_edit(std::chrono::nanoseconds patience) {
    return desk_.next(patience);
  }
  void answer(const EditQuestion&, const codecs::EditAnswer&);
  /// Who asks for the scene as it is now; nothing waits here. The thread of change(), too.
  [[nodiscard]] std::optional<SaveQuestion> next_save() { return desk_.next_save(); }
  void answer(const SaveQuestion&, Saved);
  /// What all side sessions are told.
  void tell(const codecs::SceneNews&);
  [[nodiscard]] bool has_master() const { return has_master_.load(std::memory_order_relaxed); }

 private:
  SlaveSession(const Options&, std::vector<std::byte> object, ContactSource& contacts, const Felt& felt,
               transport::WakeEvent changed, transport::ListeningPort port, transport::LaneSocket bulk,
               transport::LaneSocket haptic, std::optional<RelayedPorts> relayed);
  void run_io(const std::stop_token&);
  void take(const transport::Received&, std::span<std::byte> bytes);
  void send(const transport::Address& to, std::span<const std::byte> datagram);
  void follow_master(const transport::Received* opened);
  void look_after_relay(std::int64_t now_ns);
  void tell_of_changes(std::int64_t now_ns);
  void look_ahead(std::int64_t now_ns);
  void take_of_side(const transport::Received&, const transport::SideSessions::Heard&);
  void look_after_sides(std::int64_t now_ns);
  void take_changes(std::int64_t now_ns);
  void set_out(const motion::ObjectCourse&);
  [[nodiscard]] codecs::SlaveStatus status();
  [[nodiscard]] transport::LinkStatus link_status(std::int64_t now_ns);

  std::function<void(const std::string&)> log_;
  std::function<void()> look_at_list_;
  std::function<void(const transport::LinkStatus&)> tell_status_;
  const std::int64_t began_ns_ = transport::monotonic_ns();
  transport::ListeningPort port_;
  transport::Address local_;
  transport::LaneSocket bulk_;
  std::optional<RelayedPorts> relayed_;
  ContactLane lane_;
  TileFeed* tiles_;
  realtime::SpscQueue<SurfaceEdit> tile_edits_{64};
  realtime::SpscQueue<ObjectChange> changes_{64};
  transport::WakeEvent changed_;  // by edit() and change()
  std::atomic<std::int64_t> scene_ns_{0};
  transport::SessionServer server_;
  std::atomic<bool> has_master_{false};

  EditDesk desk_;

  // The io thread's own.
  ObjectCourses courses_;
  CourseFeed courses_to_master_{courses_};
  struct Side {
    std::uint32_t live = 0;  // the session, as it was told of
    std::unique_ptr<CourseFeed> courses;
    std::optional<transport::Received> from;  // the newest datagram, without its bytes: where answers go
  };
  std::array<Side, transport::SideSessions::kMost> sides_;
  std::uint32_t told_version_ = 0;  // of the scene, to all sides
  std::int64_t told_ns_ = 0;
  transport::SessionServer::Send send_;
  const transport::Received* question_ = nullptr;  // what is being answered
  transport::ArrivalMeter bulk_meter_;
  std::uint32_t live_ = 0;
  bool is_silent_ = false;
  std::int64_t status_ns_ = 0, list_ns_ = 0, looked_ns_ = 0;
  std::int64_t bulk_heard_ns_ = 0;  // anything at all from the bulk lane's peer

  std::jthread contact_thread_, io_thread_;  // last: they end before what they use
};

}  // namespace farfeel::slave_sim
