// A blind forwarder between two ends that cannot reach each other: what it does with each datagram.
//
//   master ──▶ relay ──▶ slave      both registered as (token, room, slot), one as master and one as slave
//          ◀──       ◀──
//
// It forwards whatever a registered end sends, as it came, to the end that is registered opposite; it never looks
// inside. Nobody is registered without a token, and without having shown that he receives at his address. Of strangers
// it keeps nothing, and answers less than they sent. Of ends it keeps an address, for as long as they ask again. No
// sockets, no clocks: time is an argument. One thread.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "transport/net/datagram.h"
#include "transport/net/udp_socket.h"
#include "transport/relay/relay_messages.h"

namespace farfeel::transport {

class RelayServer {
 public:
  static constexpr std::size_t kMostEnds = 4096;                     ///< about 1 MB of memory
  static constexpr std::int64_t kEndLife_ns = 30'000'000'000;        ///< without asking again; ends ask each 10 s
  static constexpr std::int64_t kSlotLife_ns = 10'000'000'000;       ///< then an earlier instance may have the slot
  static constexpr std::int64_t kCookiePeriod_ns = 120'000'000'000;  ///< one of this and of the last period are taken

  /// `secret` is random at every start; `key` is what tokens are made from.
  RelayServer(const Key32& key, const Key32& secret) noexcept : key_(key), secret_(secret) {}

  struct Outgoing {
    Address local;  ///< to send from
    Address to;
    std::span<const std::byte> bytes;
    std::optional<UdpSocket::Marking> marking;  ///< as it arrived, on what is forwarded
  };
  /// What to send because of this datagram: at most two. Valid until the next call.
  [[nodiscard]] std::span<const Outgoing> receive(const Received&, std::int64_t now_ns, std::uint64_t wall_s);
  /// Forgets ends that fell silent or whose token expired. About once a second.
  void forget(std::int64_t now_ns, std::uint64_t wall_s);

  struct Counters {
    std::uint64_t forwarded = 0, forwarded_bytes = 0;
    std::uint64_t over_rate = 0;  ///< dropped: more than the token grants
    std::uint64_t unpaired = 0;   ///< dropped: nobody is registered opposite
    std::uint64_t strangers = 0;  ///< dropped: of nobody who is registered, or not a message
    std::uint64_t challenged = 0, refused = 0, registered = 0;
  };
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] std::size_t ends() const noexcept { return ends_.size(); }
  [[nodiscard]] std::size_t tokens() const noexcept { return uses_.size(); }

 private:
  using Key = std::tuple<std::uint64_t, RoomId, std::uint8_t, RelayRole>;  // token, room, slot, role
  struct End {
    Address address, local;
    std::uint64_t instance = 0, nonce = 0;
    std::int64_t heard_ns = 0;
  };
  struct Use {  // of a token
    RelayGrant grant;
    Key32 key;
    std::size_t ends = 0;
    double room_bytes =
        0;  // what may be forwarded at once; begins with nothing, so that registering anew gains nothing
    std::int64_t filled_ns = 0;
  };
  using Ends = std::map<Key, End>;

  void forward(const Received&, std::int64_t now_ns);
  void take_registration(const Received&, std::int64_t now_ns, std::uint64_t wall_s);
  void refuse(const Received&, RelayRefusal, std::uint64_t nonce, std::uint64_t wall_s);
  void tell(const Key&, const End&, const Use&, std::int64_t now_ns);
  std::span<std::byte> put(const Address& local, const Address& to, std::size_t size);
  [[nodiscard]] Mac16 cookie(const Address&, std::int64_t period) const noexcept;
  Ends::iterator erase(Ends::iterator);
  [[nodiscard]] Ends::iterator opposite(const Key&);

  Key32 key_, secret_;
  Ends ends_;
  std::map<AddressBytes, Key> by_address_;
  std::map<std::uint64_t, Use> uses_;  // by the token's id; only of tokens that ends use now
  Counters counters_;
  std::array<Outgoing, 2> out_;
  std::size_t out_size_ = 0;
  std::array<std::array<std::byte, RegisteredMessage::kBytes>, 2> buffers_;
};

}  // namespace farfeel::transport
