// Where a lane's peer is, as its authentic datagrams tell, and whether that place is proven.
//
// The peer moves with its newest authentic datagram and with nothing else. Somebody between the two ends can send such
// a datagram on from any address; so until the peer has answered a challenge from there, no more bytes go to the new
// place than came from it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "transport/lane/lane_keys.h"
#include "transport/net/address.h"

namespace farfeel::transport {

class PeerPath {
 public:
  using Challenge = std::array<std::byte, 8>;  ///< random; sealed on its way, both ways

  /// A handshake's keys were sent there: who uses them from there has received them there.
  void on_handshake(const Address& to, std::uint64_t generation) noexcept;
  /// An authentic datagram came from here, with that handshake's keys. The newest tells where the peer is: address()
  /// may be another one now.
  void on_authentic(const Address& from, std::size_t bytes, bool is_newest, std::uint64_t generation) noexcept;
  /// The answer to a challenge, from the address that the challenge went to.
  void on_answer(const Address& from, std::span<const std::byte> answer) noexcept;

  [[nodiscard]] const std::optional<Address>& address() const noexcept { return address_; }
  [[nodiscard]] bool is_proven() const noexcept { return is_proven_; }
  /// Whether a datagram of so many bytes may go there now. To an unproven place, room for a challenge is always left.
  [[nodiscard]] bool may_send(std::size_t bytes, bool is_challenge = false) const noexcept {
    return is_proven_ || sent_ + bytes + (is_challenge ? 0 : sizeof(Challenge) + kSealBytes) <= received_;
  }
  void on_sent(std::size_t bytes) noexcept { sent_ += bytes; }
  /// What is to be sent there to prove the place, at most every kChallengeAgain_ns; nothing if it is proven.
  [[nodiscard]] std::optional<Challenge> challenge(std::int64_t now_ns) noexcept;
  [[nodiscard]] std::uint64_t moves() const noexcept { return moves_; }
  void forget() noexcept { *this = {}; }

  static constexpr std::int64_t kChallengeAgain_ns = 5'000'000;

 private:
  std::optional<Address> address_;
  bool is_proven_ = false;
  Address shaken_;                         // where the newest handshake's keys went
  std::uint64_t generation_ = 0;           // of those
  std::uint64_t received_ = 0, sent_ = 0;  // bytes, from and to the address since it is the peer's
  Challenge expected_{};
  std::int64_t challenged_ns_ = 0;  // 0: not yet
  std::uint64_t moves_ = 0;
};

}  // namespace farfeel::transport
