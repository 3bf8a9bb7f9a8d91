#include "transport/seal/noise.h"

#include <vector>

#include "tests/unit/transport/seal/suites.h"

namespace farfeel::transport {
namespace {

using Bytes = std::vector<std::byte>;
constexpr Key32 kZero{};

Bytes text(std::string_view s) {
  const auto bytes = std::as_bytes(std::span(s));
  return Bytes(bytes.begin(), bytes.end());
}

// Both ends of a handshake, with payloads of 9 and 5 bytes.
struct BothEnds {
  explicit BothEnds(Suite s) : suite(s) {}

  NoiseInitiator initiator(const Key32& with_psk) { return {suite, prologue, master, slave.public_key, with_psk}; }
  NoiseResponder responder() { return {suite, prologue, slave}; }

  Suite suite;
  Bytes prologue = text("prologue");
  KeyPair master = new_key_pair(), slave = new_key_pair();
  Bytes first = Bytes(9 + kNoiseFirstBytes), second = Bytes(5 + kNoiseSecondBytes);
  Bytes up = text("nine byte"), down = text("five!"), up_read = Bytes(9), down_read = Bytes(5);
};

using NoiseTest = EachSuite;
FARFEEL_EACH_SUITE(NoiseTest);

TEST_P(NoiseTest, GivesBothEndsTheSameFreshKeys) {
  BothEnds e(GetParam());
  std::vector<Key32> seen;
  for (int i = 0; i < 3; ++i) {
    auto initiator = e.initiator(kZero);
    auto responder = e.responder();
    ASSERT_EQ(initiator.write_first(e.up, e.first), e.first.size());
    ASSERT_EQ(responder.read_first(e.first, e.up_read), e.master.public_key);
    EXPECT_EQ(e.up_read, e.up);
    const SplitKeys theirs = responder.write_second(kZero, e.down, e.second);
    const auto ours = initiator.read_second(e.second, e.down_read);
    ASSERT_TRUE(ours);
    EXPECT_EQ(e.down_read, e.down);
    EXPECT_EQ(ours->initiator_to_responder, theirs.initiator_to_responder);
    EXPECT_EQ(ours->responder_to_initiator, theirs.responder_to_initiator);
    EXPECT_EQ(ours->handshake_hash, theirs.handshake_hash);
    for (const Key32& key : {theirs.initiator_to_responder, theirs.responder_to_initiator}) {
      EXPECT_EQ(std::count(seen.begin(), seen.end(), key), 0);
      seen.push_back(key);
    }
  }
}

TEST_P(NoiseTest, RefusesEveryChangedByteAndCutOfTheFirstMessage) {
  BothEnds e(GetParam());
  ASSERT_NE(e.initiator(kZero).write_first(e.up, e.first), 0u);
  for (std::size_t at = 0; at < e.first.size(); ++at) {
    for (const int change : {1, 0x80}) {
      Bytes bad = e.first;
      bad[at] ^= static_cast<std::byte>(change);
      // The ephemeral's top bit is no part of its X25519 value, but the hash knows it.
      EXPECT_FALSE(e.responder().read_first(bad, e.up_read)) << at << " by " << change;
    }
  }
  for (std::size_t size = 0; size < e.first.size(); ++size)
    EXPECT_FALSE(e.responder().read_first(std::span(e.first).first(size), e.up_read));
  EXPECT_TRUE(e.responder().read_first(e.first, e.up_read));
}

TEST_P(NoiseTest, RefusesEveryChangedByteOfTheSecondMessageAndStillTakesTheTrueOne) {
  BothEnds e(GetParam());
  auto initiator = e.initiator(kZero);
  auto responder = e.responder();
  ASSERT_NE(initiator.write_first(e.up, e.first), 0u);
  ASSERT_TRUE(responder.read_first(e.first, e.up_read));
  (void)responder.write_second(kZero, e.down, e.second);
  for (std::size_t at = 0; at < e.second.size(); ++at) {
    for (const int change : {1, 0x80}) {
      Bytes bad = e.second;
      bad[at] ^= static_cast<std::byte>(change);
      EXPECT_FALSE(initiator.read_second(bad, e.down_read)) << at << " by " << change;
    }
  }
  for (std::size_t size = 0; size < e.second.size(); ++size)
    EXPECT_FALSE(initiator.read_second(std::span(e.second).first(size), e.down_read));
  EXPECT_TRUE(initiator.read_second(e.second, e.down_read));
  EXPECT_FALSE(initiator.read_second(e.second, e.down_read)) << "a handshake ends once";
}

TEST_P(NoiseTest, EndsOnlyWithTheSamePrologueKeyAndPsk) {
  BothEnds e(GetParam());
  auto initiator = e.initiator(kZero);
  ASSERT_NE(initiator.write_first(e.up, e.first), 0u);

  const Bytes other_prologue = text("Prologue");
  EXPECT_FALSE(NoiseResponder(e.suite, other_prologue, e.slave).read_first(e.first, e.up_read));
  EXPECT_FALSE(NoiseResponder(e.suite, e.prologue, new_key_pair()).read_first(e.first, e.up_read));

  auto responder = e.responder();
  ASSERT_TRUE(responder.read_first(e.first, e.up_read));
  Key32 psk{};
  psk[31] = std::byte{1};
  (void)responder.write_second(psk, e.down, e.second);
  EXPECT_FALSE(initiator.read_second(e.second, e.down_read)) << "the initiator has no psk";
}

TEST_P(NoiseTest, AnswersToAnotherHandshakeAreRefused) {
  BothEnds e(GetParam());
  auto first = e.initiator(kZero), second = e.initiator(kZero);
  ASSERT_NE(first.write_first(e.up, e.first), 0u);
  auto responder = e.responder();
  ASSERT_TRUE(responder.read_first(e.first, e.up_read));
  (void)responder.write_second(kZero, e.down, e.second);
  ASSERT_NE(second.write_first(e.up, e.first), 0u);
  EXPECT_FALSE(second.read_second(e.second, e.down_read));
  EXPECT_TRUE(first.read_second(e.second, e.down_read));
}

TEST_P(NoiseTest, WritesTheFirstMessageOnceAndOnlyToAStrongKeyWithRoom) {
  BothEnds e(GetParam());
  auto initiator = e.initiator(kZero);
  EXPECT_EQ(initiator.write_first(e.up, std::span(e.first).first(e.first.size() - 1)), 0u);
  EXPECT_FALSE(initiator.read_second(e.second, e.down_read)) << "before the first message";
  EXPECT_NE(initiator.write_first(e.up, e.first), 0u);
  EXPECT_EQ(initiator.write_first(e.up, e.first), 0u);
  EXPECT_EQ(NoiseInitiator(e.suite, e.prologue, e.master, kZero, kZero).write_first(e.up, e.first), 0u);
}

TEST_P(NoiseTest, AWeakEphemeralIsRefused) {
  BothEnds e(GetParam());
  KeyPair weak = new_key_pair();
  weak.public_key = Key32{};
  NoiseInitiator initiator(e.suite, e.prologue, e.master, e.slave.public_key, kZero, weak);
  ASSERT_NE(initiator.write_first(e.up, e.first), 0u);
  EXPECT_FALSE(e.responder().read_first(e.first, e.up_read));
}

// RFC 2104 has no BLAKE2b vectors; this one was computed with Python's hmac and hashlib.blake2b.
TEST(HmacBlake2b, IsWhatPythonComputes) {
  const Bytes key = text("key"), first = text("The quick brown fox "), second = text("jumps over the lazy dog");
  const Hash64 mac = hmac_blake2b(key, first, second);
  std::string hex;
  for (const std::byte b : mac) {
    hex += "0123456789abcdef"[static_cast<int>(b) >> 4];
    hex += "0123456789abcdef"[static_cast<int>(b) & 15];
  }
  EXPECT_EQ(hex,
            "92294f92c0dfb9b00ec9ae8bd94d7e7d8a036b885a499f149dfe2fd2199394aaaf6b8894a1730cccb2cd050f9bcf5062a38b51b0da"
            "b33207f8ef35ae2c9df51b");
}

}  // namespace
}  // namespace farfeel::transport
