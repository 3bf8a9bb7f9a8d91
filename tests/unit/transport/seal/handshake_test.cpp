#include "transport/seal/handshake.h"

#include <algorithm>
#include <vector>

#include "tests/unit/transport/seal/suites.h"

namespace farfeel::transport {
namespace {

using Bytes = std::vector<std::byte>;

constexpr InitiationPayload kAsk{.counter = 0x0102030405060708, .master = 77, .wall_clock_ns = -5};
constexpr ResponsePayload kAnswer{
    .epoch = 1ull << 40, .session = 0xfffffffe, .verdict = Verdict::kBusy, .wall_clock_ns = 1'700'000'000'000'000'000};

struct BothEnds {
  explicit BothEnds(Suite suite) : initiator(suite, LaneKind::kBulk, 1001, master, slave.public_key, psk) {
    EXPECT_TRUE(initiator.write_initiation(kAsk, initiation));
  }
  InitiationHead head() const { return read_initiation_head(initiation, slave_mac1_key); }
  /// What the slave answers, or nothing if it cannot read the initiation.
  std::optional<SplitKeys> answer(const Key32& with_psk) {
    ResponderHandshake responder(head(), slave);
    if (!responder.read_initiation(initiation)) return std::nullopt;
    return responder.write_response(2002, with_psk, kAnswer, response);
  }

  KeyPair master = new_key_pair(), slave = new_key_pair();
  Key32 psk = new_key_pair().secret;
  Key32 slave_mac1_key = mac1_key_of(slave.public_key), master_mac1_key = mac1_key_of(master.public_key);
  InitiatorHandshake initiator;
  std::array<std::byte, kInitiationBytes> initiation;
  std::array<std::byte, kResponseBytes> response;
};

using HandshakeTest = EachSuite;
FARFEEL_EACH_SUITE(HandshakeTest);

TEST_P(HandshakeTest, CarriesItsPayloadsAndGivesTheSameKeys) {
  BothEnds e(GetParam());
  const auto head = e.head();
  ASSERT_TRUE(head.ok());
  EXPECT_EQ(head.suite, GetParam());
  EXPECT_EQ(head.lane, LaneKind::kBulk);
  EXPECT_EQ(head.sender_index, 1001u);
  EXPECT_TRUE(is_mac2_zero(e.initiation));

  ResponderHandshake responder(head, e.slave);
  const auto initiation = responder.read_initiation(e.initiation);
  ASSERT_TRUE(initiation);
  EXPECT_EQ(initiation->sender, e.master.public_key);
  EXPECT_EQ(initiation->payload.counter, kAsk.counter);
  EXPECT_EQ(initiation->payload.master, kAsk.master);
  EXPECT_EQ(initiation->payload.wall_clock_ns, kAsk.wall_clock_ns);

  const SplitKeys theirs = responder.write_response(2002, e.psk, kAnswer, e.response);
  const auto response_head = read_response_head(e.response, e.master_mac1_key);
  ASSERT_TRUE(response_head);
  EXPECT_EQ(response_head->sender_index, 2002u);
  EXPECT_EQ(response_head->receiver_index, 1001u);
  EXPECT_EQ(response_head->suite, GetParam());
  EXPECT_EQ(response_head->lane, LaneKind::kBulk);

  const auto response = e.initiator.read_response(e.response);
  ASSERT_TRUE(response);
  EXPECT_EQ(response->sender_index, 2002u);
  EXPECT_EQ(response->payload.epoch, kAnswer.epoch);
  EXPECT_EQ(response->payload.session, kAnswer.session);
  EXPECT_EQ(response->payload.verdict, kAnswer.verdict);
  EXPECT_EQ(response->payload.wall_clock_ns, kAnswer.wall_clock_ns);
  EXPECT_EQ(response->keys.initiator_to_responder, theirs.initiator_to_responder);
  EXPECT_EQ(response->keys.responder_to_initiator, theirs.responder_to_initiator);
  EXPECT_NE(theirs.initiator_to_responder, theirs.responder_to_initiator);
  EXPECT_EQ(response->keys.handshake_hash, theirs.handshake_hash);
  EXPECT_FALSE(e.initiator.read_response(e.response)) << "a handshake ends once";
  EXPECT_FALSE(e.initiator.write_initiation(kAsk, e.initiation)) << "another try is another handshake";
}

// Whoever changes a byte in between can make mac1 right again: it is made of a public key. Nothing is accepted even so.
TEST_P(HandshakeTest, AnInitiationWithAnyByteChangedAndItsMacMendedIsRefused) {
  BothEnds e(GetParam());
  for (std::size_t at = 0; at < kInitiationBytes - 2 * kMacBytes; ++at) {
    for (const int change : {1, 0x10, 0x80, 0xff}) {
      auto bad = e.initiation;
      bad[at] ^= static_cast<std::byte>(change);
      EXPECT_FALSE(read_initiation_head(bad, e.slave_mac1_key).ok());
      write_mac1(e.slave_mac1_key, bad);
      const auto head = read_initiation_head(bad, e.slave_mac1_key);
      if (head.ok()) {
        EXPECT_FALSE(ResponderHandshake(head, e.slave).read_initiation(bad)) << at << " by " << change;
      }
    }
  }
  EXPECT_TRUE(e.answer(e.psk));
}

TEST_P(HandshakeTest, AResponseWithAnyByteChangedAndItsMacMendedIsRefused) {
  BothEnds e(GetParam());
  ASSERT_TRUE(e.answer(e.psk));
  for (std::size_t at = 0; at < kResponseBytes - 2 * kMacBytes; ++at) {
    for (const int change : {1, 0x10, 0x80, 0xff}) {
      auto bad = e.response;
      bad[at] ^= static_cast<std::byte>(change);
      EXPECT_FALSE(read_response_head(bad, e.master_mac1_key));
      write_mac1(e.master_mac1_key, bad);
      EXPECT_FALSE(e.initiator.read_response(bad)) << at << " by " << change;
    }
  }
  for (std::size_t size = 0; size < kResponseBytes; ++size)
    EXPECT_FALSE(e.initiator.read_response(std::span(e.response).first(size)));
  EXPECT_TRUE(e.initiator.read_response(e.response)) << "what was forged must not use the handshake up";
}

TEST_P(HandshakeTest, NeedsTheSamePskAtBothEnds) {
  BothEnds e(GetParam());
  ASSERT_TRUE(e.answer(kNoPsk));
  EXPECT_FALSE(e.initiator.read_response(e.response));
}

TEST_P(HandshakeTest, AnotherSlaveCannotReadOrAnswer) {
  BothEnds e(GetParam());
  const KeyPair other = new_key_pair();
  EXPECT_EQ(read_initiation_head(e.initiation, mac1_key_of(other.public_key)).fault, HeadFault::kWrongKey);
  EXPECT_FALSE(ResponderHandshake(e.head(), other).read_initiation(e.initiation));
}

TEST_P(HandshakeTest, WritesNothingToAWeakKey) {
  const KeyPair own = new_key_pair();
  std::array<std::byte, kInitiationBytes> out;
  EXPECT_FALSE(InitiatorHandshake(GetParam(), LaneKind::kHaptic, 1, own, Key32{}, kNoPsk).write_initiation(kAsk, out));
}

TEST_P(HandshakeTest, TakesTheAnswersOfSeveralTriesWhicheverComes) {
  BothEnds e(GetParam());
  InitiatorHandshake second(GetParam(), LaneKind::kBulk, 1002, e.master, e.slave.public_key, e.psk);
  std::array<std::byte, kInitiationBytes> initiation;
  ASSERT_TRUE(second.write_initiation(kAsk, initiation));
  ASSERT_TRUE(e.answer(e.psk));
  EXPECT_FALSE(second.read_response(e.response));
  EXPECT_TRUE(e.initiator.read_response(e.response));
}

}  // namespace
}  // namespace farfeel::transport
