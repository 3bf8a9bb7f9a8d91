// The operator's end of a session: greets the slave, takes its scene, keeps the session alive while the loop runs.
//
// Two threads use it: its own io thread runs the bulk lane and both lanes' handshakes (transport/session_client.h), and
// the haptic thread calls remote(). When a lane falls silent, or the slave was restarted, the io thread greets it again
// by itself; the loop meanwhile holds and fades, and feels contacts again as soon as they come.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <tl/expected.hpp>

#include "codecs/scene/scene_description.h"
#include "codecs/wire/slave_status.h"
#include "haptic_core/contact/doubts.h"
#include "master_station/session/course_receiver.h"
#include "master_station/session/haptic_lane.h"
#include "master_station/session/relayed_lanes.h"
#include "master_station/session/tile_receiver.h"
#include "transport/session_client.h"
#include "transport/status/link_status.h"

namespace farfeel::master_station {

/// Two quantiles of the round trip, the slave's computing taken out and its waiting left in [ms]; NaN before any.
struct RoundTrip {
  double p50_ms, p99_ms;
  std::uint64_t samples = 0;
};

/// What became of the session's datagrams, over all its reconnections.
struct LinkReport {
  RoundTrip round_trip;
  transport::LaneCounters up;    ///< pose samples: sent counted here, the rest by the slave
  transport::LaneCounters down;  ///< contact sets: sent counted by the slave, the rest here
  std::uint64_t malformed = 0;   ///< either way
  std::uint64_t contacts_left_out = 0;
  contact::DoubtCounts doubts;               ///< of the slave's contacts
  std::uint64_t sessions = 0;                ///< 1 while the slave lives, however often the link was away
  std::uint64_t tiles = 0, tile_bytes = 0;   ///< height tiles here, and bytes of all messages that brought them
  std::optional<codecs::SlaveStatus> slave;  ///< the newest
};

class MasterSession {
 public:
  struct Options {
    /// Where the slave may be: tried one after another, 250 ms apart, and the first that answers is it.
    std::vector<transport::Address> slave;
    transport::Greeter greeter;     ///< who greets, and the slave's key
    double connect_timeout_s = 10;  ///< to be greeted, and then without any more of the scene
    /// One line for a person while connecting, with the scene's share that is here (0..1); on the caller's thread.
    std::function<void(const std::string&, double)> progress;
    std::optional<transport::RelayAccess> relay = {};  ///< tried after the addresses, of which there may be none then
    /// Called four times a second, on the io thread, with all that is known of the link; may be empty.
    std::function<void(const transport::LinkStatus&)> tell_status = {};
    codecs::DecodeMeshes decode_meshes = codecs::decode_meshes;  ///< of the scene: here, or apart (scene_apart.h)
  };
  enum class State : std::uint8_t {
    kConnected,   ///< contacts flow
    kLost,        ///< greeting again; trouble() says why
    kOtherScene,  ///< the slave came back with another scene: no contacts until adopt_scene()
  };

  /// Blocks until the scene is here and decoded, or the time is up, or `should_stop` (if given) says so.
  [[nodiscard]] static tl::expected<std::unique_ptr<MasterSession>, transport::Error> connect(
      const Options&, const std::function<bool()>& should_stop = {});
  /// Says goodbye and ends the io thread. The haptic thread must have stopped using remote().
  ~MasterSession();

  MasterSession(const MasterSession&) = delete;
  MasterSession& operator=(const MasterSession&) = delete;

  [[nodiscard]] HapticLane& remote() { return lane_; }  ///< for the haptic thread
  [[nodiscard]] const codecs::SceneDescription& scene() const { return scene_; }
  [[nodiscard]] std::size_t scene_bytes() const { return scene_bytes_; }
  /// The scene's felt surfaces, for the haptic thread; null where the slave tells of none. Place kept until
  /// adopt_scene().
  [[nodiscard]] local_model::TileCache* tiles() const { return tiles_.get(); }
  void want_tiles();  ///< from now on the slave is asked for heights; tiles() must be taken from, or they wait there
  [[nodiscard]] double greeting_ms() const { return greeting_ms_; }         ///< of the handshake
  [[nodiscard]] const transport::Address& slave() const { return slave_; }  ///< or the relay that leads there
  [[nodiscard]] transport::Suite suite() const;                             ///< of the bulk lane's newest keys
  /// The slave's wall clock less this one's, at the newest handshake [s].
  [[nodiscard]] double clock_difference_s() const;
  [[nodiscard]] double scene_ms() const { return scene_ms_; }  ///< from the first welcome to the decoded scene

  // Any thread but the haptic one.
  [[nodiscard]] State state() const;
  /// Where the haptic lane's datagrams go, for a person; another line when a direct way past the relay is found or
  /// lost.
  [[nodiscard]] std::string way() const;
  /// What the objects that may change do, as the slave told it; the haptic thread gets it by itself.
  [[nodiscard]] std::vector<motion::ObjectCourse> courses() const;
  [[nodiscard]] std::string trouble() const;  ///< why there is no session; empty while there is one
  [[nodiscard]] LinkReport report();
  /// The same, once the loop has stopped: waits until the slave has told what became of the last poses, 1 s at most.
  [[nodiscard]] LinkReport last_report();
  /// In state kOtherScene: decodes the new scene, after which contacts flow again. The loop must not run meanwhile.
  [[nodiscard]] tl::expected<void, transport::Error> adopt_scene();

 private:
  MasterSession(const Options&, const transport::Address& slave, transport::UdpSocket haptic, transport::UdpSocket bulk,
                transport::WakeEvent, transport::SessionClient, std::optional<RelayedLanes>);
  [[nodiscard]] tl::expected<void, transport::Error> wait_for_scene(const Options&, std::int64_t until_ns,
                                                                    const std::function<bool()>& should_stop);
  void run_io(const std::stop_token&);
  void look_after(std::int64_t now_ns);
  void look_after_relay(bool uses_haptic, std::int64_t now_ns);
  void send(transport::LaneKind, std::span<const std::byte> datagram);
  void send_to(transport::LaneKind, const transport::Address& to, std::span<const std::byte> datagram);
  void take_status(std::span<const std::byte> payload);
  [[nodiscard]] bool may_take_tiles() const;
  void take_course(std::span<const std::byte> payload);
  void request_tiles(std::int64_t now_ns, const transport::SessionClient::Send&);
  bool tell_held(std::int64_t now_ns, const transport::SessionClient::Send&);
  [[nodiscard]] codecs::SlaveStatus told_by_slave() const;  ///< its counters, over all sessions
  void tell_status(std::int64_t now_ns);
  [[nodiscard]] transport::LinkStatus link_status(std::int64_t now_ns);
  [[nodiscard]] bool is_adopted() const;  ///< the live session's scene is the one that the loop simulates

  const codecs::DecodeMeshes decode_meshes_;
  const std::function<void(const transport::LinkStatus&)> tell_status_;
  const std::int64_t began_ns_ = transport::monotonic_ns();
  transport::UdpSocket bulk_;
  transport::WakeEvent wake_;  // from the haptic thread
  HapticLane lane_;

  mutable std::mutex mutex_;  // of what follows; never taken by the haptic thread
  std::condition_variable changed_;
  transport::SessionClient client_;
  std::optional<RelayedLanes> relayed_;
  const transport::Address slave_;  // or the relay's
  transport::ArrivalMeter bulk_meter_;
  std::uint64_t bulk_arrivals_ = 0;
  std::size_t longest_bulk_bytes_ = 0;               // of those
  std::uint64_t haptic_moves_ = 0, bulk_moves_ = 0;  // of this machine's address
  std::int64_t told_ns_ = 0;
  std::int64_t moved_ns_ = 0;                         // when it was last looked whether this machine's address changed
  std::optional<transport::ReceivedObject> adopted_;  // the scene that the loop simulates
  codecs::PoseGrid grid_;                             // of its poses on the wire
  std::uint32_t status_session_ = 0;
  std::uint64_t statuses_ = 0;  // taken so far
  std::int64_t first_welcome_ns_ = 0;
  std::optional<codecs::SlaveStatus> status_;  // of status_session_
  codecs::SlaveStatus before_;                 // sums of earlier sessions' counters

  CourseReceiver courses_;
  bool wants_tiles_ = false;
  std::unique_ptr<local_model::TileCache> tiles_;
  std::optional<TileReceiver> tile_receiver_;
  std::uint64_t tiles_epoch_ = 0;   // of the slave that the tiles here are from
  std::uint32_t tiles_round_ = 0;   // counts the caches
  std::uint32_t held_told_to_ = 0;  // session
  std::int64_t requested_ns_ = 0;

  codecs::SceneDescription scene_;
  std::size_t scene_bytes_ = 0;
  double greeting_ms_ = 0, scene_ms_ = 0;

  std::jthread io_thread_;  // last: it ends before what it uses
};

}  // namespace farfeel::master_station
