#include "transport/lane/peer_path.h"

#include <algorithm>

#include "transport/seal/suite.h"

namespace farfeel::transport {

void PeerPath::on_handshake(const Address& to, std::uint64_t generation) noexcept {
  shaken_ = to;
  generation_ = generation;
}

void PeerPath::on_authentic(const Address& from, std::size_t bytes, bool is_newest, std::uint64_t generation) noexcept {
  if (address_ == from) {
    received_ += bytes;
  } else if (is_newest) {  // a late copy says where the peer was
    moves_ += address_ ? 1 : 0;
    address_ = from;
    is_proven_ = false;
    received_ = bytes;
    sent_ = 0;
    challenged_ns_ = 0;
    fill_randomly(expected_);
  }
  if (address_ == from && generation == generation_ && from == shaken_) is_proven_ = true;
}

void PeerPath::on_answer(const Address& from, std::span<const std::byte> answer) noexcept {
  if (address_ == from && challenged_ns_ != 0 && std::ranges::equal(answer, expected_)) is_proven_ = true;
}

std::optional<PeerPath::Challenge> PeerPath::challenge(std::int64_t now_ns) noexcept {
  if (!address_ || is_proven_) return std::nullopt;
  if (challenged_ns_ != 0 && now_ns - challenged_ns_ < kChallengeAgain_ns) return std::nullopt;
  challenged_ns_ = now_ns;
  return expected_;
}

}  // namespace farfeel::transport
