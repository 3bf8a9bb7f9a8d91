#include "transport/relay/relay_server.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <vector>

namespace farfeel::transport {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
using Bytes = std::vector<std::byte>;

class Relay : public testing::Test {
 protected:
  static Address at(int host, std::uint16_t port = 5000) {
    return parse_address("203.0.113." + std::to_string(host) + ":" + std::to_string(port)).value();
  }
  static Key32 key(int fill) {
    Key32 k;
    k.fill(static_cast<std::byte>(fill));
    return k;
  }
  std::vector<std::pair<Address, Bytes>> send(const Address& from, std::span<const std::byte> bytes) {
    Received received;
    received.bytes = bytes;
    received.from = from;
    received.to = own_;
    received.has_marking = true;
    received.dscp = 46;
    received.ecn = Ecn::kCongestion;
    std::vector<std::pair<Address, Bytes>> out;
    for (const auto& o : server_.receive(received, now_, wall_)) {
      EXPECT_EQ(o.local, own_);
      marking_ = o.marking;
      out.emplace_back(o.to, Bytes(o.bytes.begin(), o.bytes.end()));
      bytes_to_[to_bytes(o.to)] += o.bytes.size();
    }
    bytes_from_[to_bytes(from)] += bytes.size();
    return out;
  }
  std::vector<std::pair<Address, Bytes>> ask(const Address& from, const RelayToken& token, RelayRole role,
                                             const Mac16& cookie, std::uint64_t instance = 1, std::uint8_t slot = 0,
                                             const std::string& room = "lab") {
    Bytes bytes(RegisterMessage::kBytes);
    write(RegisterMessage{role, slot, ++nonce_, instance, token.grant, room_id(token, room), cookie}, token.key, bytes);
    return send(from, bytes);
  }
  /// With the challenge answered.
  std::vector<std::pair<Address, Bytes>> enter(const Address& from, const RelayToken& token, RelayRole role,
                                               std::uint64_t instance = 1, std::uint8_t slot = 0,
                                               const std::string& room = "lab") {
    const auto challenged = ask(from, token, role, {}, instance, slot, room);
    const auto challenge = read_challenge(challenged.at(0).second);
    EXPECT_TRUE(challenge);
    return ask(from, token, role, challenge->cookie, instance, slot, room);
  }
  static std::optional<RelayRefusal> refusal(const std::vector<std::pair<Address, Bytes>>& out) {
    if (out.size() != 1) return std::nullopt;
    const auto refused = read_refused(out[0].second);
    return refused ? std::optional(refused->reason) : std::nullopt;
  }
  RelayToken token(std::uint16_t most_ends = 4, std::uint32_t rate_kbit = 20'000) const {
    return make_token(key(1), {most_ends * 1000u + rate_kbit, wall_ + 1000, rate_kbit, most_ends});
  }

  std::int64_t now_ = 1000 * kSecond;
  std::uint64_t wall_ = 1'700'000'000, nonce_ = 0;
  Address own_ = parse_address("198.51.100.1:47200").value();
  RelayServer server_{key(1), key(2)};
  std::optional<UdpSocket::Marking> marking_;
  std::map<AddressBytes, std::size_t> bytes_to_, bytes_from_;
  const Bytes data_ = Bytes(791, std::byte{4});
};

TEST_F(Relay, ForwardsBetweenTwoEndsAndTellsEachOfTheOther) {
  const auto alone = enter(at(1), token(), RelayRole::kMaster);
  ASSERT_EQ(alone.size(), 1u);
  const auto first = read_registered(alone[0].second);
  ASSERT_TRUE(first && is_signed(alone[0].second, token().key));
  EXPECT_EQ(first->own, at(1));
  EXPECT_EQ(first->peer, std::nullopt);
  EXPECT_TRUE(send(at(1), data_).empty()) << "nobody is there yet";

  const auto both = enter(at(2), token(), RelayRole::kSlave);
  ASSERT_EQ(both.size(), 2u) << "the other end is told, too";
  const auto to_slave = read_registered(both[0].second), to_master = read_registered(both[1].second);
  ASSERT_TRUE(to_slave && to_master);
  EXPECT_EQ(both[0].first, at(2));
  EXPECT_EQ(both[1].first, at(1));
  EXPECT_EQ(to_slave->peer, at(1));
  EXPECT_EQ(to_master->peer, at(2));
  EXPECT_EQ(to_master->nonce, first->nonce);
  EXPECT_EQ(to_master->probe_secret, to_slave->probe_secret);

  now_ += kSecond;
  for (const auto& [from, to] : {std::pair{at(1), at(2)}, std::pair{at(2), at(1)}}) {
    const auto out = send(from, data_);
    ASSERT_EQ(out.size(), 1u);
    EXPECT_EQ(out[0].first, to);
    EXPECT_EQ(out[0].second, data_) << "as it came";
    ASSERT_TRUE(marking_);
    EXPECT_EQ(marking_->dscp, 46);
    EXPECT_EQ(marking_->ecn, Ecn::kCongestion);
  }
  EXPECT_TRUE(send(at(3), data_).empty()) << "a stranger";
  EXPECT_TRUE(send(at(1), Bytes(791, std::byte{20})).empty()) << "probes go past the relay";
}

TEST_F(Relay, KeepsRoomsSlotsAndTokensApart) {
  const RelayToken other = make_token(key(1), {5, wall_ + 1000, 1000, 8});
  EXPECT_EQ(enter(at(1), token(8), RelayRole::kMaster, 1, 0).size(), 1u);
  EXPECT_EQ(enter(at(2), token(8), RelayRole::kSlave, 1, 1).size(), 1u);
  EXPECT_EQ(enter(at(3), token(8), RelayRole::kSlave, 1, 0, "another").size(), 1u);
  EXPECT_EQ(enter(at(4), other, RelayRole::kSlave, 1, 0).size(), 1u);
  EXPECT_TRUE(send(at(1), data_).empty());
  EXPECT_EQ(server_.ends(), 4u);
  EXPECT_EQ(server_.tokens(), 2u);
  EXPECT_EQ(enter(at(5), token(8), RelayRole::kSlave, 1, 0).size(), 2u);
}

TEST_F(Relay, SendsNoMoreToAnUnprovenAddressThanCameFromIt) {
  std::mt19937 random(4);
  const auto known = enter(at(1), token(), RelayRole::kMaster);
  const Mac16 cookie_of_another = read_registered(known[0].second)->cookie;
  Bytes valid(RegisterMessage::kBytes);
  write(RegisterMessage{RelayRole::kSlave, 0, 1, 1, token().grant, room_id(token(), "lab"), cookie_of_another},
        token().key, valid);
  for (int i = 0; i < 20'000; ++i) {
    Bytes bytes = random() % 2 ? valid : Bytes(random() % 200);
    if (bytes.size() != valid.size())
      for (std::byte& b : bytes) b = static_cast<std::byte>(random());
    const auto mutations = random() % 4;
    for (unsigned m = 0; m < mutations && !bytes.empty(); ++m)
      bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    if (!bytes.empty() && random() % 4 == 0) bytes[0] = std::byte{16};
    if (bytes.size() > 1 && random() % 4 == 0) bytes[1] = std::byte{1};
    send(at(100 + static_cast<int>(random() % 100), static_cast<std::uint16_t>(1 + random() % 1000)), bytes);
  }
  for (const auto& [address, bytes] : bytes_to_) EXPECT_LE(bytes, bytes_from_[address]);
  EXPECT_EQ(server_.ends(), 1u) << "strangers cost no memory";
  EXPECT_EQ(server_.tokens(), 1u);
  EXPECT_GT(server_.counters().challenged, 1000u);
}

TEST_F(Relay, TakesACookieFromItsOwnAddressAloneAndNotForLong) {
  const auto challenged = ask(at(1), token(), RelayRole::kMaster, {});
  const Mac16 cookie = read_challenge(challenged.at(0).second)->cookie;
  EXPECT_TRUE(read_challenge(ask(at(2), token(), RelayRole::kMaster, cookie).at(0).second)) << "another host";
  EXPECT_TRUE(read_challenge(ask(at(1, 5001), token(), RelayRole::kMaster, cookie).at(0).second)) << "another port";
  now_ += RelayServer::kCookiePeriod_ns;
  EXPECT_TRUE(read_registered(ask(at(1), token(), RelayRole::kMaster, cookie).at(0).second));
  now_ += RelayServer::kCookiePeriod_ns;
  EXPECT_TRUE(read_challenge(ask(at(1), token(), RelayRole::kMaster, cookie).at(0).second)) << "two periods later";
}

TEST_F(Relay, RefusesWhomItDoesNotKnowAndSaysWhy) {
  RelayToken forged = token();
  forged.grant.rate_kbit *= 100;
  EXPECT_EQ(refusal(enter(at(1), forged, RelayRole::kMaster)), RelayRefusal::kUnknownToken);
  EXPECT_EQ(refusal(enter(at(1), make_token(key(9), token().grant), RelayRole::kMaster)), RelayRefusal::kUnknownToken);
  EXPECT_EQ(refusal(enter(at(1), make_token(key(1), {1, wall_, 1000, 4}), RelayRole::kMaster)), RelayRefusal::kExpired);
  EXPECT_EQ(refusal(enter(at(1), make_token(key(1), {2, wall_ + 9, 1000, 0}), RelayRole::kMaster)),
            RelayRefusal::kFull);
  EXPECT_EQ(server_.ends(), 0u);
  Bytes later(RegisterMessage::kBytes);
  write(RegisterMessage{}, token().key, later);
  later[1] = std::byte{2};
  EXPECT_EQ(refusal(send(at(1), later)), RelayRefusal::kOtherVersion);
}

TEST_F(Relay, HoldsATokenToItsNumberOfEnds) {
  for (int i = 1; i <= 4; ++i)
    EXPECT_EQ(refusal(enter(at(i), token(4), RelayRole::kMaster, 1, 0, std::to_string(i))), std::nullopt);
  EXPECT_EQ(refusal(enter(at(5), token(4), RelayRole::kMaster, 1, 0, "5")), RelayRefusal::kFull);
  EXPECT_EQ(refusal(enter(at(4), token(4), RelayRole::kMaster, 1, 0, "5")), std::nullopt)
      << "a socket is one end: it moved";
  EXPECT_EQ(server_.ends(), 4u);
}

TEST_F(Relay, GivesASlotToTheNewestInstance) {
  enter(at(1), token(), RelayRole::kMaster);
  const auto before = read_registered(enter(at(2), token(), RelayRole::kSlave, 10)[0].second);
  EXPECT_EQ(refusal(enter(at(3), token(), RelayRole::kSlave, 9)), RelayRefusal::kSlotTaken);
  const auto moved = enter(at(4), token(), RelayRole::kSlave, 10);  // the same program, whose address changed
  ASSERT_EQ(moved.size(), 2u);
  EXPECT_EQ(read_registered(moved[1].second)->peer, at(4));
  EXPECT_EQ(read_registered(moved[1].second)->probe_secret, before->probe_secret);
  const auto restarted = enter(at(5), token(), RelayRole::kSlave, 11);
  ASSERT_EQ(restarted.size(), 2u);
  EXPECT_NE(read_registered(restarted[1].second)->probe_secret, before->probe_secret);
  now_ += kSecond;
  EXPECT_EQ(send(at(1), data_).at(0).first, at(5));
  EXPECT_TRUE(send(at(2), data_).empty());
  EXPECT_TRUE(send(at(4), data_).empty());
  now_ += RelayServer::kSlotLife_ns;
  EXPECT_EQ(refusal(enter(at(3), token(), RelayRole::kSlave, 9)), std::nullopt) << "the newest fell silent";
}

TEST_F(Relay, ForgetsEndsThatFellSilentOrWhoseTokenExpired) {
  enter(at(1), token(), RelayRole::kMaster);
  enter(at(2), token(), RelayRole::kSlave);
  now_ += RelayServer::kEndLife_ns - kSecond;
  enter(at(2), token(), RelayRole::kSlave);
  now_ += 2 * kSecond;
  server_.forget(now_, wall_);
  EXPECT_EQ(server_.ends(), 1u);
  EXPECT_TRUE(send(at(2), data_).empty());
  EXPECT_TRUE(send(at(1), data_).empty());
  wall_ += 1000;
  server_.forget(now_, wall_);
  EXPECT_EQ(server_.ends(), 0u);
  EXPECT_EQ(server_.tokens(), 0u);
}

TEST_F(Relay, ForwardsAtMostTheTokensRate) {
  const RelayToken slow = token(8, 1000), fast = token(8, 100'000);
  enter(at(1), slow, RelayRole::kMaster);
  enter(at(2), slow, RelayRole::kSlave);
  enter(at(3), slow, RelayRole::kMaster, 1, 1);  // another lane, of the same token
  enter(at(4), slow, RelayRole::kSlave, 1, 1);
  enter(at(5), fast, RelayRole::kMaster);
  enter(at(6), fast, RelayRole::kSlave);
  now_ += kSecond;
  std::size_t slow_bytes = 0, fast_bytes = 0;
  for (int ms = 0; ms < 10'000; ++ms) {
    now_ += 1'000'000;
    for (const int from : {1, 2, 3, 4, 5, 6})
      for (const auto& [to, bytes] : send(at(from), data_)) (from < 5 ? slow_bytes : fast_bytes) += bytes.size() + 48;
    if (ms % 100 == 0) enter(at(1), slow, RelayRole::kMaster);  // which gains nothing
  }
  EXPECT_NEAR(static_cast<double>(slow_bytes), 1e6 / 8 * 10, 70'000);
  EXPECT_EQ(fast_bytes, 20'000 * (data_.size() + 48)) << "one token's flood is not another's";
  EXPECT_GT(server_.counters().over_rate, 10'000u);
}

TEST_F(Relay, IsBoundedInMemory) {
  for (int i = 0; i < static_cast<int>(RelayServer::kMostEnds) + 100; ++i) {
    const RelayToken one = make_token(key(1), {static_cast<std::uint64_t>(i), wall_ + 9, 1, 4});
    enter(at(1 + i % 250, static_cast<std::uint16_t>(1 + i / 250)), one, RelayRole::kMaster);
  }
  EXPECT_EQ(server_.ends(), RelayServer::kMostEnds);
}

}  // namespace
}  // namespace farfeel::transport
