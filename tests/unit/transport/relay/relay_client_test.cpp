#include "transport/relay/relay_client.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>

#include "tests/support/simulated_nats.h"
#include "transport/relay/relay_server.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kMs = 1'000'000, kSecond = 1000 * kMs;
using State = RelayClient::State;

Address address(const char* text) {
  return parse_address(text).value();
}

Key32 key(int fill) {
  Key32 k;
  k.fill(static_cast<std::byte>(fill));
  return k;
}

/// An end as a lane would be: it sends a numbered pose each millisecond to where its peer is. The master's goes to
/// path(), the slave's to where the newest of the master's came from, for that is what roaming is.
struct End {
  RelayClient client;
  Address self;
  RelayRole role;
  std::optional<Address> peer_at;
  std::uint32_t sent = 0, newest = 0, received = 0;
  std::int64_t heard_ns = 0;
};

class RelayedSession : public testing::Test {
 protected:
  const Address relay_ = address("198.51.100.1:47200");
  const Address inside_[2] = {address("10.0.0.1:5000"), address("10.0.0.2:5000")};  // master, slave
  const Address outside_[2] = {address("203.0.113.1:1"), address("203.0.113.2:1")};
  RelayToken token_ = make_token(key(1), {1, 2'000'000'000, 20'000, 4});

  void start(NatKind master, NatKind slave) {
    server_ = std::make_unique<RelayServer>(key(1), key(2));
    net_.add_nat(inside_[0], outside_[0], master);
    net_.add_nat(inside_[1], outside_[1], slave);
    net_.add_host(relay_, [&](const Address& from, const Address&, std::span<const std::byte> bytes) {
      if (!relay_is_up_) return;
      Received received;
      received.bytes = bytes;
      received.from = from;
      received.to = relay_;
      for (const auto& out : server_->receive(received, net_.now_ns(), 1'900'000'000))
        net_.send(relay_, out.to, out.bytes);
    });
  }
  void join(RelayRole role, std::uint64_t instance = 1) {
    const int i = static_cast<int>(role);
    const RelayClient::Options options{relay_, token_, "lab", role, 0, instance, key(10 + i)};
    ends_[i] = std::make_unique<End>(End{RelayClient(options, net_.now_ns()), inside_[i], role, {}});
    End& end = *ends_[i];
    net_.add_host(inside_[i], [&, this](const Address& from, const Address&, std::span<const std::byte> bytes) {
      if (end.client.receive(from, bytes, net_.now_ns())) return;
      std::uint32_t number = 0;
      std::memcpy(&number, bytes.data(), sizeof number);
      ++end.received;
      end.heard_ns = net_.now_ns();
      if (number >= end.newest) {
        end.newest = number;
        end.peer_at = from;
      }
    });
  }
  /// A first byte below 16, as the link's datagrams have: numbers stay below 2^28 and end in 4.
  void run_for(std::int64_t ns) {
    const std::int64_t until = net_.now_ns() + ns;
    while (net_.now_ns() < until) {
      net_.run_until(net_.now_ns() + kMs);
      if (net_.now_ns() % kSecond == 0) server_->forget(net_.now_ns(), 1'900'000'000);
      for (const auto& end : ends_) {
        if (!end) continue;
        const bool is_due = end->client.due_ns() <= net_.now_ns();
        EXPECT_EQ(send_all(*end), is_due);
        if (end->heard_ns != 0 && net_.now_ns() - end->heard_ns > 150 * kMs) end->client.note_silence(net_.now_ns());
        const std::uint32_t number = ++end->sent << 8 | 4;
        const auto to = end->role == RelayRole::kMaster ? end->client.path() : end->peer_at;
        if (to) net_.send(end->self, *to, std::as_bytes(std::span(&number, 1)));
      }
    }
  }
  /// What the client has to say. Whether there was anything.
  bool send_all(End& end) {
    bool any = false;
    for (int most = 10; most > 0; --most) {
      const auto out = end.client.next(net_.now_ns());
      if (!out) return any;
      any = true;
      net_.send(end.self, out->to, out->bytes);
    }
    ADD_FAILURE() << "it never stops";
    return any;
  }
  End& master() { return *ends_[0]; }
  End& slave() { return *ends_[1]; }
  State state(const End& end) const { return end.client.state(net_.now_ns()); }

  SimulatedNats net_;
  std::unique_ptr<RelayServer> server_;
  std::unique_ptr<End> ends_[2];
  bool relay_is_up_ = true;
};

constexpr NatKind kFullCone{Looks::kNowhere, Looks::kNowhere}, kRestricted{Looks::kNowhere, Looks::kAtHost},
    kPortRestricted{Looks::kNowhere, Looks::kAtHostAndPort}, kSymmetric{Looks::kAtHostAndPort, Looks::kAtHostAndPort};

struct Pair {
  const char* name;
  NatKind master, slave;
  bool is_direct;  ///< whether hole punching finds a way between two such NATs
};
class BetweenNats : public RelayedSession, public testing::WithParamInterface<Pair> {};
INSTANTIATE_TEST_SUITE_P(Relay, BetweenNats,
                         testing::Values(Pair{"ConeCone", kFullCone, kFullCone, true},
                                         Pair{"ConeSymmetric", kFullCone, kSymmetric, true},
                                         Pair{"RestrictedRestricted", kRestricted, kRestricted, true},
                                         Pair{"RestrictedSymmetric", kRestricted, kSymmetric, true},
                                         Pair{"SymmetricRestricted", kSymmetric, kRestricted, true},
                                         Pair{"PortRestrictedBoth", kPortRestricted, kPortRestricted, true},
                                         Pair{"PortRestrictedSymmetric", kPortRestricted, kSymmetric, false},
                                         Pair{"SymmetricBoth", kSymmetric, kSymmetric, false}),
                         [](const auto& which) { return which.param.name; });

TEST_P(BetweenNats, IsRelayedAtOnceAndDirectWhereThatCanBe) {
  start(GetParam().master, GetParam().slave);
  join(RelayRole::kSlave);
  run_for(10 * kSecond);
  EXPECT_EQ(state(slave()), State::kAlone);
  join(RelayRole::kMaster);
  run_for(6 * net_.delay_ns + 5 * kMs);  // challenge and registration, 2 round trips, and a way to the slave
  EXPECT_GT(slave().received, 0u) << "relayed as soon as the relay knows both";
  run_for(kSecond);
  for (End* end : {&master(), &slave()}) {
    EXPECT_EQ(state(*end), GetParam().is_direct ? State::kDirect : State::kRelayed);
    EXPECT_EQ(end->client.trouble(net_.now_ns()), std::nullopt);
  }
  EXPECT_EQ(net_.passed_two_nats > 0, GetParam().is_direct);
  const auto forwarded = server_->counters().forwarded;
  const std::uint32_t sent = master().sent, received[2] = {master().received, slave().received};
  run_for(20 * kSecond);
  EXPECT_EQ(master().sent - sent, 20'000u);
  for (const int i : {0, 1})
    EXPECT_EQ(ends_[i]->received - received[i], 20'000u) << "nothing is lost in the steady state";
  EXPECT_EQ(server_->counters().forwarded - forwarded, GetParam().is_direct ? 0u : 40'000u);
}

TEST_P(BetweenNats, LosesNothingWhenItBecomesDirect) {
  start(GetParam().master, GetParam().slave);
  join(RelayRole::kSlave);
  join(RelayRole::kMaster);
  run_for(200 * kMs);
  const std::uint32_t sent = master().sent, received = slave().received, answered = master().received;
  ASSERT_GT(received, 0u);
  run_for(5 * kSecond);
  EXPECT_GE(slave().received - received, master().sent - sent - 1);
  EXPECT_GE(master().received - answered + 50, 5000u)
      << "the direct way is not longer: some of the slave's are overtaken";
}

TEST_F(RelayedSession, FallsBackToTheRelayWhenTheDirectWayCloses) {
  start(kPortRestricted, kPortRestricted);
  join(RelayRole::kSlave);
  join(RelayRole::kMaster);
  run_for(3 * kSecond);
  ASSERT_EQ(state(master()), State::kDirect);
  net_.direct_is_blocked = true;
  run_for(400 * kMs);
  EXPECT_EQ(master().client.path(), relay_);
  const std::uint32_t received = slave().received;
  run_for(kSecond);
  EXPECT_EQ(slave().received - received, 1000u);
  net_.direct_is_blocked = false;
  run_for(4 * kSecond);
  EXPECT_EQ(state(master()), State::kDirect) << "tried again";
}

TEST_F(RelayedSession, SurvivesNatsThatForget) {
  start(kPortRestricted, kPortRestricted);
  join(RelayRole::kSlave);
  join(RelayRole::kMaster);
  run_for(3 * kSecond);
  net_.forget_mappings();
  run_for(2 * kSecond);
  const std::uint32_t received = slave().received;
  run_for(kSecond);
  EXPECT_EQ(slave().received - received, 1000u);
}

TEST_F(RelayedSession, SurvivesARelayThatRestarts) {
  start(kSymmetric, kSymmetric);
  join(RelayRole::kSlave);
  join(RelayRole::kMaster);
  run_for(3 * kSecond);
  server_ = std::make_unique<RelayServer>(key(1), key(3));  // it has forgotten all, its cookies' secret too
  run_for(kSecond);
  const std::uint32_t received = slave().received;
  run_for(kSecond);
  EXPECT_EQ(slave().received - received, 1000u);
}

TEST_F(RelayedSession, NeedsNoRelayOnceItIsDirect) {
  start(kPortRestricted, kPortRestricted);
  join(RelayRole::kSlave);
  join(RelayRole::kMaster);
  run_for(3 * kSecond);
  relay_is_up_ = false;
  const std::uint32_t received = slave().received;
  run_for(60 * kSecond);
  EXPECT_EQ(slave().received - received, 60'000u);
}

TEST_F(RelayedSession, FindsARestartedPeer) {
  start(kPortRestricted, kPortRestricted);
  join(RelayRole::kSlave);
  join(RelayRole::kMaster);
  run_for(3 * kSecond);
  net_.forget_mappings();
  join(RelayRole::kSlave, 2);
  run_for(2 * kSecond);
  EXPECT_GT(slave().received, 900u);
  EXPECT_EQ(state(master()), State::kDirect);
}

TEST_F(RelayedSession, SaysThatTheRelayIsSilent) {
  start(kFullCone, kFullCone);
  relay_is_up_ = false;
  join(RelayRole::kMaster);
  run_for(2 * kSecond);
  EXPECT_EQ(master().client.trouble(net_.now_ns()), std::nullopt);
  run_for(2 * kSecond);
  const auto trouble = master().client.trouble(net_.now_ns());
  ASSERT_TRUE(trouble);
  EXPECT_EQ(trouble->kind, ErrorKind::kTimeout);
  EXPECT_NE(trouble->message.find("198.51.100.1:47200 does not answer"), std::string::npos);
  relay_is_up_ = true;
  run_for(5 * kSecond);
  EXPECT_EQ(master().client.trouble(net_.now_ns()), std::nullopt);
  EXPECT_EQ(state(master()), State::kAlone);
}

TEST_F(RelayedSession, SaysWhyTheRelayRefuses) {
  const std::pair<RelayToken, const char*> cases[] = {
      {make_token(key(1), {1, 1'900'000'000 - 7200, 1, 4}), "expired 2 hours ago"},
      {make_token(key(2), {1, 2'000'000'000, 1, 4}), "does not know this token"},
      {make_token(key(1), {1, 2'000'000'000, 1, 0}), "it is full"}};
  start(kFullCone, kFullCone);
  for (const auto& [token, words] : cases) {
    token_ = token;
    join(RelayRole::kMaster);
    run_for(kSecond);
    const auto trouble = master().client.trouble(net_.now_ns());
    ASSERT_TRUE(trouble);
    EXPECT_EQ(trouble->kind, ErrorKind::kRefused);
    EXPECT_NE(trouble->message.find(words), std::string::npos) << trouble->message;
  }
}

TEST_F(RelayedSession, BelievesNobodyElse) {
  start(kFullCone, kFullCone);
  join(RelayRole::kSlave);
  join(RelayRole::kMaster);
  net_.direct_is_blocked = true;
  run_for(3 * kSecond);
  const Address thief = address("192.0.2.66:1");
  std::vector<std::byte> bytes(RegisteredMessage::kBytes);
  RelayClient& client = master().client;
  for (int i = 0; i < 1000; ++i) {
    write(RegisteredMessage{0, static_cast<std::uint64_t>(i), {}, thief, thief, {}}, key(5), bytes);
    EXPECT_TRUE(client.receive(i % 2 ? thief : relay_, bytes, net_.now_ns()));
    write(ProbeMessage{0, true, {}}, bytes);
    EXPECT_TRUE(client.receive(thief, std::span(bytes).first(ProbeMessage::kBytes), net_.now_ns()));
    write(RefusedMessage{RelayRefusal::kExpired, static_cast<std::uint64_t>(i), 0}, bytes);
    EXPECT_TRUE(client.receive(relay_, std::span(bytes).first(RefusedMessage::kBytes), net_.now_ns()));
  }
  EXPECT_EQ(client.path(), relay_);
  EXPECT_EQ(client.trouble(net_.now_ns()), std::nullopt);
  EXPECT_EQ(state(master()), State::kRelayed);
}

TEST_F(RelayedSession, AsksSeldom) {
  start(kPortRestricted, kPortRestricted);
  join(RelayRole::kSlave);
  std::size_t asked = 0;
  const std::int64_t start = net_.now_ns();
  for (; net_.now_ns() < start + 600 * kSecond; net_.run_until(net_.now_ns() + 10 * kMs)) {
    while (const auto out = slave().client.next(net_.now_ns())) {
      ++asked;
      net_.send(slave().self, out->to, out->bytes);
    }
  }
  EXPECT_LT(asked, 310u) << "each 2 s while nobody is there";
}

}  // namespace
}  // namespace farfeel::transport
