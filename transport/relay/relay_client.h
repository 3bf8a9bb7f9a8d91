// One end's side of a relay, for one socket: registers, stays registered, and looks for a way past the relay.
//
// The socket is unconnected, or a ListeningPort whose LaneSocket gives back what relay_type() knows: the relay's
// messages and probes come to the port, whoever the lane is connected to. What the lane sends goes to path(), first the
// relay's address, as if the relay were the peer. The relay tells where it sees the peer; both ends send probes there,
// and once one was answered the direct way is open both ways, path() is the peer's own address, and a master's lane
// sends there. A slave's needs nothing: it follows authenticated data, as always. When a lane falls silent it says so,
// and path() is the relay again.
//
// No sockets, no clocks: time is an argument. One thread. No call allocates but trouble().
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "transport/error.h"
#include "transport/net/address.h"
#include "transport/relay/relay_messages.h"

namespace farfeel::transport {

class RelayClient {
 public:
  struct Options {
    Address relay;
    RelayToken token;
    std::string room;  ///< a name that both ends were given
    RelayRole role = RelayRole::kMaster;
    std::uint8_t slot = 0;       ///< below kRelaySlots: the lane
    std::uint64_t instance = 0;  ///< greater at every start of this end, such as the wall clock [ns]
    Key32 random{};              ///< random_key()
  };
  RelayClient(const Options&, std::int64_t now_ns);

  struct Outgoing {
    Address to;
    std::span<const std::byte> bytes;  ///< valid until the next call
  };
  /// What to send now; ask until there is nothing.
  [[nodiscard]] std::optional<Outgoing> next(std::int64_t now_ns);
  /// When next() will have something.
  [[nodiscard]] std::int64_t due_ns() const noexcept;

  /// True if the datagram was for here; the others are the link's.
  bool receive(const Address& from, std::span<const std::byte> datagram, std::int64_t now_ns);

  enum class State : std::uint8_t {
    kAsking,   ///< the relay has not answered, or not for kRelayLife_ns
    kAlone,    ///< registered; the peer is not
    kRelayed,  ///< what is sent to the relay arrives at the peer
    kDirect,   ///< what is sent to path() arrives at the peer, and the relay stands by
  };
  [[nodiscard]] State state(std::int64_t now_ns) const noexcept;
  /// Where a lane sends. Changes in receive() and note_silence() alone.
  [[nodiscard]] Address path() const noexcept { return proven_.value_or(options_.relay); }
  /// The lane has heard nothing for longer than it should: the direct way, if that was in use, is left, and tried again
  /// after 1 s, then twice as long each time up to 64 s, or from 1 s again if it lasted that long; and the relay is
  /// asked again now, in case it was restarted.
  void note_silence(std::int64_t now_ns);

  [[nodiscard]] const std::optional<Address>& own() const noexcept { return own_; }  ///< as the relay sees it
  /// What to tell people: the relay's refusal, or its silence for kSilence_ns since it was first asked. Allocates.
  [[nodiscard]] std::optional<Error> trouble(std::int64_t now_ns) const;

  static constexpr std::int64_t kRelayLife_ns = 25'000'000'000;
  static constexpr std::int64_t kSilence_ns = 3'000'000'000;

 private:
  void take_registered(const RegisteredMessage&, std::int64_t now_ns);
  void take_probe(const Address& from, const ProbeMessage&, std::int64_t now_ns);
  std::uint64_t new_nonce() noexcept;

  Options options_;
  RoomId room_;
  std::int64_t start_ns_, ask_ns_;  // ask_ns_: when to register next
  int unanswered_ = 0;
  std::uint64_t nonces_made_ = 0, nonce_ = 0, former_nonce_ = 0;
  bool is_challenge_open_ = false;  // one challenge is answered for each nonce
  Mac16 cookie_{};
  std::optional<std::int64_t> registered_ns_;
  std::optional<RefusedMessage> refusal_;

  std::optional<Address> own_, told_, seen_, proven_;  // the peer: as told by the relay, as its probes came, as proven
  bool is_peer_there_ = false;                         // by the relay's last word
  Mac16 probe_secret_{};
  std::int64_t probing_since_ns_ = 0, probe_ns_ = 0, proven_ns_ = 0;
  unsigned next_place_ = 0;  // of told_ and seen_, which to probe next
  int failures_ = 0;
  std::array<Address, 4> answers_;  // probes to answer; more at once are dropped
  std::size_t answers_size_ = 0;
  std::array<std::byte, RegisterMessage::kBytes> buffer_;
};

}  // namespace farfeel::transport
