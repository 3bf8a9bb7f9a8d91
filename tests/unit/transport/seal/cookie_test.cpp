#include "transport/seal/cookie.h"

#include <gtest/gtest.h>

#include <vector>

#include "transport/seal/handshake.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

std::array<std::byte, 6> address(int last) {
  return {std::byte{10}, {}, {}, static_cast<std::byte>(last), {}, {}};
}

struct Cookies : testing::Test {
  using Datagram = std::array<std::byte, kInitiationBytes>;
  using Reply = std::array<std::byte, kCookieReplyBytes>;

  Datagram initiation() {
    Datagram d;
    InitiatorHandshake handshake(Suite::kChaChaPoly, LaneKind::kHaptic, ++index, master, slave.public_key, kNoPsk);
    EXPECT_TRUE(handshake.write_initiation({}, d));
    jar.sign(d, now_ns);
    return d;
  }
  Reply reply(const Datagram& d, int from = 1) {
    Reply r;
    maker.write_reply(d, address(from), now_ns, r);
    return r;
  }
  bool is_proven(const Datagram& d, int from = 1) { return maker.is_mac2_right(d, address(from), now_ns); }

  KeyPair master = new_key_pair(), slave = new_key_pair();
  CookieMaker maker{slave.public_key};
  CookieJar jar{slave.public_key};
  std::uint32_t index = 40;
  std::int64_t now_ns = 5 * kSecond_ns;
};

TEST_F(Cookies, ProveAnAddress) {
  const Datagram first = initiation();
  EXPECT_TRUE(is_mac2_zero(first));
  EXPECT_FALSE(is_proven(first));
  EXPECT_FALSE(jar.has_cookie(now_ns));
  ASSERT_TRUE(jar.read_reply(reply(first), now_ns));
  const Datagram second = initiation();
  EXPECT_TRUE(is_proven(second));
  EXPECT_FALSE(is_proven(second, 2)) << "another address has another cookie";
  EXPECT_TRUE(read_initiation_head(second, mac1_key_of(slave.public_key)).ok());
}

TEST_F(Cookies, AChangedMac2ProvesNothing) {
  ASSERT_TRUE(jar.read_reply(reply(initiation()), now_ns));
  const Datagram good = initiation();
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (const int change : {1, 0x80}) {
      Datagram bad = good;
      bad[at] ^= static_cast<std::byte>(change);
      EXPECT_FALSE(is_proven(bad)) << at;
    }
  }
}

TEST_F(Cookies, AReplyWithAnyByteChangedOrCutIsRefused) {
  const Reply good = reply(initiation());
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (int change = 1; change < 256; ++change) {
      Reply bad = good;
      bad[at] ^= static_cast<std::byte>(change);
      ASSERT_FALSE(jar.read_reply(bad, now_ns)) << at << " by " << change;
    }
  }
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(jar.read_reply(std::span(good).first(size), now_ns));
  EXPECT_FALSE(jar.has_cookie(now_ns));
  EXPECT_TRUE(jar.read_reply(good, now_ns));
}

TEST_F(Cookies, AReplyToSomebodyElsesInitiationIsRefused) {
  (void)initiation();
  Datagram strange;
  InitiatorHandshake handshake(Suite::kChaChaPoly, LaneKind::kHaptic, index, master, slave.public_key, kNoPsk);
  ASSERT_TRUE(handshake.write_initiation({}, strange));
  EXPECT_FALSE(jar.read_reply(reply(strange), now_ns));
}

TEST_F(Cookies, AReplyToAnEarlierTryIsTaken) {
  const Datagram early = initiation();
  for (std::size_t i = 1; i < CookieJar::kRemembered; ++i) (void)initiation();
  const Reply late = reply(early);
  EXPECT_TRUE(jar.read_reply(late, now_ns));
  (void)initiation();
  EXPECT_FALSE(jar.read_reply(late, now_ns)) << "one too many since";
}

TEST_F(Cookies, LastForOneToTwoLivesAtTheSlaveAndForOneAtTheMaster) {
  ASSERT_TRUE(jar.read_reply(reply(initiation()), now_ns));
  const std::int64_t made_ns = now_ns;
  now_ns = made_ns + kCookieLife_ns - 1;
  const Datagram last = initiation();
  EXPECT_FALSE(is_mac2_zero(last));
  EXPECT_TRUE(is_proven(last));
  now_ns = made_ns + kCookieLife_ns;
  EXPECT_TRUE(is_mac2_zero(initiation())) << "the master forgets it";
  EXPECT_TRUE(is_proven(last)) << "the slave still knows the secret before";
  now_ns = made_ns + 2 * kCookieLife_ns;
  EXPECT_FALSE(is_proven(last));
}

TEST_F(Cookies, ASecretThatWasNotUsedForLongIsNotBelieved) {
  ASSERT_TRUE(jar.read_reply(reply(initiation()), now_ns));
  const Datagram signed_one = initiation();
  now_ns += 2 * kCookieLife_ns;
  EXPECT_FALSE(is_proven(signed_one));
}

TEST_F(Cookies, OfTwoSlavesDiffer) {
  CookieMaker other{slave.public_key};
  const Datagram first = initiation();
  ASSERT_TRUE(jar.read_reply(reply(first), now_ns));
  EXPECT_FALSE(other.is_mac2_right(initiation(), address(1), now_ns));
}

}  // namespace
}  // namespace farfeel::transport
