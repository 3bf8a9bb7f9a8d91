#include "transport/seal/suite.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "tests/support/realtime_guard.h"
#include "tests/unit/transport/seal/suites.h"

namespace farfeel::transport {
namespace {

using Bytes = std::vector<std::byte>;

Bytes random_bytes(std::size_t size) {
  Bytes bytes(size);
  fill_randomly(bytes);
  return bytes;
}

using SealKeyTest = EachSuite;
FARFEEL_EACH_SUITE(SealKeyTest);

TEST_P(SealKeyTest, OpensWhatItSealedAtEverySizeOfADatagram) {
  const SealKey key(GetParam(), random_key());
  for (std::size_t size = 0; size <= 1232; size += size < 70 ? 1 : 83) {
    const Bytes plain = random_bytes(size), head = random_bytes(size % 17);
    Bytes sealed(size + kTagBytes), opened(size);
    key.seal(size, head, plain, sealed);
    ASSERT_TRUE(key.open(size, head, sealed, opened));
    EXPECT_EQ(opened, plain);
    if (size >= 16) {
      EXPECT_FALSE(std::equal(plain.begin(), plain.end(), sealed.begin()));
    }
  }
}

TEST_P(SealKeyTest, WorksInPlace) {
  const SealKey key(GetParam(), random_key());
  const Bytes plain = random_bytes(791);
  Bytes apart(plain.size() + kTagBytes), in_place(plain);
  key.seal(7, {}, plain, apart);
  in_place.resize(apart.size());
  key.seal(7, {}, std::span(in_place).first(plain.size()), in_place);
  EXPECT_EQ(in_place, apart);
  ASSERT_TRUE(key.open(7, {}, in_place, std::span(in_place).first(plain.size())));
  EXPECT_TRUE(std::equal(plain.begin(), plain.end(), in_place.begin()));
}

TEST_P(SealKeyTest, RefusesEveryChangeOfEveryByte) {
  const SealKey key(GetParam(), random_key());
  const Bytes head = random_bytes(16), plain = random_bytes(100);
  Bytes sealed(plain.size() + kTagBytes), opened(plain.size());
  key.seal(3, head, plain, sealed);
  for (int change = 1; change < 256; ++change) {
    for (std::size_t at = 0; at < sealed.size(); ++at) {
      Bytes bad = sealed;
      bad[at] ^= static_cast<std::byte>(change);
      ASSERT_FALSE(key.open(3, head, bad, opened)) << at << " by " << change;
    }
    for (std::size_t at = 0; at < head.size(); ++at) {
      Bytes bad = head;
      bad[at] ^= static_cast<std::byte>(change);
      ASSERT_FALSE(key.open(3, bad, sealed, opened)) << at << " by " << change;
    }
  }
  EXPECT_TRUE(key.open(3, head, sealed, opened));
}

TEST_P(SealKeyTest, RefusesAnotherCounterAnotherKeyAndOtherSizes) {
  const Key32 secret = random_key();
  const SealKey key(GetParam(), secret);
  const Bytes plain = random_bytes(40);
  Bytes sealed(56), opened(40);
  constexpr std::uint64_t counter = 0x0102030405060708;
  key.seal(counter, {}, plain, sealed);
  for (int bit = 0; bit < 64; ++bit) EXPECT_FALSE(key.open(counter ^ (std::uint64_t{1} << bit), {}, sealed, opened));
  for (std::size_t at = 0; at < secret.size(); ++at) {
    Key32 other = secret;
    other[at] ^= std::byte{1};
    EXPECT_FALSE(SealKey(GetParam(), other).open(counter, {}, sealed, opened)) << at;
  }
  for (std::size_t size = 0; size < sealed.size(); ++size) {
    const auto cut = std::span(sealed).first(size);
    EXPECT_FALSE(key.open(counter, {}, cut, std::span(opened).first(size < kTagBytes ? 0 : size - kTagBytes)));
    EXPECT_FALSE(key.open(counter, {}, cut, opened));
  }
  EXPECT_TRUE(key.open(counter, {}, sealed, opened));
}

TEST_P(SealKeyTest, IsTheSameKeyAfterACopyOrAMove) {
  auto first = std::make_unique<SealKey>(GetParam(), random_key());
  const Bytes plain = random_bytes(116);
  Bytes sealed(plain.size() + kTagBytes), opened(plain.size());
  first->seal(1, {}, plain, sealed);
  SealKey copy = *first;
  const SealKey moved = std::move(*first);
  first.reset();
  EXPECT_TRUE(copy.open(1, {}, sealed, opened));
  EXPECT_TRUE(moved.open(1, {}, sealed, opened));
  copy = SealKey(GetParam(), random_key());
  EXPECT_FALSE(copy.open(1, {}, sealed, opened));
}

TEST_P(SealKeyTest, SealsAndOpensWithoutALockOrAnAllocation) {
  if (!test_support::RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need malloc themselves";
  const SealKey key(GetParam(), random_key());
  const Bytes plain = random_bytes(791), head = random_bytes(16);
  Bytes sealed(plain.size() + kTagBytes), opened(plain.size());
  const auto before = test_support::RealtimeGuard::violations();
  bool is_open = false;
  {
    const test_support::RealtimeGuard guard;
    const SealKey copy = key;
    copy.seal(1, head, plain, sealed);
    is_open = key.open(1, head, sealed, opened);
  }
  EXPECT_TRUE(is_open);
  EXPECT_EQ(test_support::RealtimeGuard::violations(), before) << test_support::RealtimeGuard::first_violation();
}

TEST_P(SealKeyTest, LeavesNothingOfItselfInMemory) {
  alignas(SealKey) std::array<std::byte, sizeof(SealKey)> place{};
  auto* key = new (place.data()) SealKey(GetParam(), random_key());
  const auto is_zero = [](std::byte b) { return b == std::byte{0}; };
  EXPECT_FALSE(std::ranges::all_of(std::span(place).first(32), is_zero));
  key->~SealKey();
  // The expanded key is the first 512 bytes; what follows says which suite.
  EXPECT_TRUE(std::ranges::all_of(std::span(place).first(512), is_zero));
}

TEST(Suite, ChaChaIsAlwaysThere) {
  EXPECT_TRUE(is_available(Suite::kChaChaPoly));
}

TEST(Suite, NumbersBeyondTheTwoAreNotAvailable) {
  EXPECT_FALSE(is_available(static_cast<Suite>(0)));
  EXPECT_FALSE(is_available(static_cast<Suite>(3)));
}

TEST(KeyPair, SharesASecretWithAnother) {
  const KeyPair a = new_key_pair(), b = new_key_pair();
  EXPECT_NE(a.public_key, b.public_key);
  EXPECT_EQ(key_pair_of(a.secret).public_key, a.public_key);
  EXPECT_EQ(shared_secret(a, b.public_key), shared_secret(b, a.public_key));
  EXPECT_NE(shared_secret(a, b.public_key), shared_secret(a, a.public_key));
}

// X25519's points of small order, 0, 1, p - 1, p and p + 1 (RFC 7748, section 6.1, tells to refuse what they give).
TEST(KeyPair, SharesNothingWithAWeakKey) {
  std::vector<Key32> weak(3);
  weak[1][0] = std::byte{1};
  weak[2].fill(std::byte{0xff});  // p - 1, little-endian, with p = 2^255 - 19; then p and p + 1
  weak[2][0] = std::byte{0xec};
  weak[2][31] = std::byte{0x7f};
  Key32 p = weak[2], p_and_1 = weak[2];
  p[0] = std::byte{0xed};
  p_and_1[0] = std::byte{0xee};
  weak.push_back(p);
  weak.push_back(p_and_1);
  const KeyPair own = new_key_pair();
  for (const Key32& key : weak) EXPECT_FALSE(shared_secret(own, key));
}

TEST(IsSameSecret, ComparesSizesAndEveryByte) {
  const Bytes a = random_bytes(32);
  EXPECT_TRUE(is_same_secret(a, Bytes(a)));
  EXPECT_FALSE(is_same_secret(a, std::span(a).first(31)));
  for (std::size_t at = 0; at < a.size(); ++at) {
    Bytes b = a;
    b[at] ^= std::byte{0x80};
    EXPECT_FALSE(is_same_secret(a, b));
  }
}

}  // namespace
}  // namespace farfeel::transport
