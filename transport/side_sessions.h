// Side sessions: of those who watch a slave's scene or edit it, beside the one master whose hand feels it. Each has a
// bulk lane alone. Time is an argument; no sockets; the io thread's.
//
// Who may have one is known by key, and one process has one; a process that was silent for kSilence_ns loses its place
// to whoever comes. All places are made at the start: strangers cost no memory, and the trusted a bounded one.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "transport/bulk_peer.h"
#include "transport/lane/handshake_server.h"

namespace farfeel::transport {

struct SideSession {
  std::uint32_t id = 0;  ///< random, not 0
  Key32 key{};
  std::string name;       ///< as the allow-list has it
  bool may_edit = false;  ///< all may watch
  std::uint64_t process = 0;
  std::int64_t heard_ns = 0;
  bool is_live = false;  ///< a datagram has come with its keys
};

class SideSessions {
 public:
  static constexpr std::size_t kMost = 8, kMostOfOneKey = 4;
  using Send = BulkPeer::Send;

  /// scene: offered to everybody; may be null.
  explicit SideSessions(const std::shared_ptr<const Object>& scene);

  /// Takes a place where there is one, for an applicant that is authentic.
  [[nodiscard]] Admission decide(const Applicant&, std::int64_t now_ns);
  void on_keys(const LaneKeys&, const Address& asked_from, std::int64_t now_ns);

  struct Heard {
    std::size_t place = 0;
    std::optional<Message> message;  ///< a request
  };
  /// Nothing where the datagram is not of a side session.
  [[nodiscard]] std::optional<Heard> on_datagram(const Address& from, std::span<std::byte> datagram,
                                                 std::int64_t now_ns, const Send&);
  void on_time(std::int64_t now_ns, const Send&);
  [[nodiscard]] std::int64_t next_time_ns(std::int64_t now_ns);
  void send(std::size_t place, MessageType, std::span<const std::byte> payload, std::int64_t now_ns, const Send&);
  /// Ends the sessions of those who are not on the list any more, or may no longer do what theirs is for.
  void on_changed_list(const HandshakeServer::Find&, std::int64_t now_ns, const Send&);
  void end_all(std::int64_t now_ns, const Send&);

  /// The live session at a place, or null.
  [[nodiscard]] const SideSession* live(std::size_t place) const {
    const auto& session = places_[place].session;
    return session && session->is_live ? &*session : nullptr;
  }
  /// For sources, which are added before anybody comes.
  [[nodiscard]] BulkLane& bulk(std::size_t place) { return places_[place].peer.bulk(); }

 private:
  struct Place {
    std::optional<SideSession> session;
    BulkPeer peer;
    void leave() { session.reset(), peer.forget(); }
  };
  [[nodiscard]] static bool is_free(const Place& place, std::int64_t now_ns) {
    return !place.session || now_ns - place.session->heard_ns > kSilence_ns;
  }
  std::array<Place, kMost> places_;
};

}  // namespace farfeel::transport
