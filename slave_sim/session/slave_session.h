// The remote node on the network: listens on PORT (haptic lane) and PORT + 1 (bulk lane), serves one master at a time.
//
// Two threads: io runs the bulk lane (transport/session_server.h), contact runs the haptic lane (contact_lane.h). A
// master that is gone for 2 s frees the session; another one that comes earlier is refused with the reason.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/wire/slave_status.h"
#include "slave_sim/session/contact_lane.h"
#include "slave_sim/session/tile_feed.h"
#include "transport/session_server.h"

namespace farfeel::slave_sim {

class SlaveSession {
 public:
  struct Options {
    transport::Address local;  ///< loopback; port 0 takes a free pair
    /// One line for a person, on the io thread; may be empty.
    std::function<void(const std::string&)> log;
    tool::MassProperties body = {};  ///< of the tool, for masters that let it be simulated here
  };

  /// What a master gets to feel with between contacts.
  struct Felt {
    std::vector<std::byte> outline;  ///< codecs::write_felt_outline; empty: contacts alone
    TileFeed* tiles = nullptr;       ///< for the io thread alone; outlives the session; null if there is no texture
  };

  /// scene: what every master gets first, with the outline (codecs::write_scene). contacts must outlive the session.
  [[nodiscard]] static tl::expected<std::unique_ptr<SlaveSession>, transport::Error> start(
      const Options&, const std::vector<std::byte>& scene, ContactSource& contacts, const Felt& felt = {{}, nullptr});
  /// Says goodbye to the master and ends both threads.
  ~SlaveSession();

  SlaveSession(const SlaveSession&) = delete;
  SlaveSession& operator=(const SlaveSession&) = delete;

  [[nodiscard]] const transport::Address& local() const { return local_; }  ///< with the real PORT
  /// A surface changes, now and for all masters to come, who get its new tile in place of the old. Any one thread;
  /// waits while the session's own have not caught up.
  void edit(const SurfaceEdit&);
  [[nodiscard]] bool has_master() const { return has_master_.load(std::memory_order_relaxed); }

 private:
  SlaveSession(const Options&, std::vector<std::byte> object, ContactSource& contacts, TileFeed* tiles,
               std::array<transport::UdpSocket, 2> sockets);
  void run_io(const std::stop_token&);
  void tell_of_changes(std::uint32_t id);
  void feed_tiles(std::int64_t now_ns, const transport::SessionServer::Send&);
  [[nodiscard]] codecs::SlaveStatus status();

  std::function<void(const std::string&)> log_;
  transport::Address local_;
  transport::UdpSocket bulk_;
  ContactLane lane_;
  TileFeed* tiles_;
  realtime::SpscQueue<SurfaceEdit> tile_edits_{64};
  transport::SessionServer server_;
  std::atomic<bool> has_master_{false};

  // The io thread's own.
  std::uint32_t live_ = 0;
  std::int64_t status_ns_ = 0;

  std::jthread contact_thread_, io_thread_;  // last: they end before what they use
};

}  // namespace farfeel::slave_sim
