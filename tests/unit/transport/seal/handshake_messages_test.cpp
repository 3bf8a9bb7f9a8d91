#include "transport/seal/handshake_messages.h"

#include <gtest/gtest.h>

#include <vector>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
namespace {

using Bytes = std::vector<std::byte>;

// A datagram whose head and macs are right, and whose middle is zeros.
Bytes datagram(DatagramType type, std::size_t size, const Key32& mac1_key) {
  Bytes d(size);
  ByteWriter w(d);
  w.u8(static_cast<std::uint8_t>(type));
  w.u8(kLinkVersion);
  w.u8(static_cast<std::uint8_t>(Suite::kChaChaPoly));
  w.u8(static_cast<std::uint8_t>(LaneKind::kBulk));
  w.u32(0x11223344);
  w.u32(0x55667788);
  write_mac1(mac1_key, d);
  return d;
}

struct Heads : testing::Test {
  Key32 mac1_key = mac1_key_of(new_key_pair().public_key);
  Bytes initiation = datagram(DatagramType::kInitiation, kInitiationBytes, mac1_key);
  Bytes response = datagram(DatagramType::kResponse, kResponseBytes, mac1_key);

  HeadFault fault_with(std::size_t at, int value) {
    Bytes d = initiation;
    d[at] = static_cast<std::byte>(value);
    write_mac1(mac1_key, d);
    return read_initiation_head(d, mac1_key).fault;
  }
  bool is_response_with(std::size_t at, int value) {
    Bytes d = response;
    d[at] = static_cast<std::byte>(value);
    write_mac1(mac1_key, d);
    return read_response_head(d, mac1_key).has_value();
  }
};

TEST_F(Heads, SayWhatStandsInThem) {
  const auto head = read_initiation_head(initiation, mac1_key);
  ASSERT_TRUE(head.ok());
  EXPECT_EQ(head.suite, Suite::kChaChaPoly);
  EXPECT_EQ(head.lane, LaneKind::kBulk);
  EXPECT_EQ(head.sender_index, 0x11223344u);
  const auto back = read_response_head(response, mac1_key);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->suite, Suite::kChaChaPoly);
  EXPECT_EQ(back->lane, LaneKind::kBulk);
  EXPECT_EQ(back->sender_index, 0x11223344u);
  EXPECT_EQ(back->receiver_index, 0x55667788u);
}

TEST_F(Heads, WithAnyByteChangedAreNotForUsExceptInMac2) {
  for (std::size_t at = 0; at < initiation.size(); ++at) {
    for (int change = 1; change < 256; ++change) {
      Bytes bad = initiation;
      bad[at] ^= static_cast<std::byte>(change);
      const bool is_mac2 = at >= initiation.size() - kMacBytes;
      const HeadFault fault = read_initiation_head(bad, mac1_key).fault;
      const bool is_bent = fault == HeadFault::kNotOurs || fault == HeadFault::kWrongKey;
      ASSERT_EQ(is_bent, !is_mac2) << at;
    }
  }
  for (std::size_t at = 0; at < response.size(); ++at) {
    for (int change = 1; change < 256; ++change) {
      Bytes bad = response;
      bad[at] ^= static_cast<std::byte>(change);
      ASSERT_FALSE(read_response_head(bad, mac1_key)) << at;
    }
  }
}

TEST_F(Heads, OfAnotherSizeOrForAnotherKeyAreNotForUs) {
  for (std::size_t size = 0; size <= 300; ++size) {
    Bytes d(initiation);
    d.resize(size);
    if (size >= 2 * kMacBytes) write_mac1(mac1_key, d);
    EXPECT_EQ(read_initiation_head(d, mac1_key).ok(), size == kInitiationBytes) << size;
    d = response;
    d.resize(size);
    if (size >= 2 * kMacBytes) write_mac1(mac1_key, d);
    EXPECT_EQ(read_response_head(d, mac1_key).has_value(), size == kResponseBytes) << size;
  }
  const Key32 other = mac1_key_of(new_key_pair().public_key);
  EXPECT_EQ(read_initiation_head(initiation, other).fault, HeadFault::kWrongKey);
  EXPECT_FALSE(read_response_head(response, other));
}

TEST_F(Heads, WithARightMacTellWhatIsOther) {
  EXPECT_EQ(fault_with(0, 2), HeadFault::kNotOurs);
  EXPECT_EQ(fault_with(1, kLinkVersion - 1), HeadFault::kOtherVersion);
  EXPECT_EQ(fault_with(1, kLinkVersion + 1), HeadFault::kOtherVersion);
  EXPECT_EQ(fault_with(2, 0), HeadFault::kOtherSuite);
  EXPECT_EQ(fault_with(2, 3), HeadFault::kOtherSuite);
  EXPECT_EQ(fault_with(2, 1), is_available(Suite::kAesGcm) ? HeadFault::kNone : HeadFault::kOtherSuite);
  EXPECT_EQ(fault_with(3, 0), HeadFault::kNone);
  EXPECT_EQ(fault_with(3, 2), HeadFault::kNone);
  EXPECT_EQ(fault_with(3, 3), HeadFault::kNotOurs);
  EXPECT_TRUE(is_response_with(3, 0));
  for (const auto& [at, value] : {std::pair{0, 1}, {1, 1}, {2, 0}, {2, 3}, {3, 3}})
    EXPECT_FALSE(is_response_with(static_cast<std::size_t>(at), value)) << at;
}

// A later version may be longer or shorter. Its first 8 bytes and its macs are enough to answer it.
TEST_F(Heads, OfAnotherVersionAreKnownAtAnySize) {
  for (const std::size_t size : {40u, 41u, 100u, 223u, 225u, 1232u}) {
    Bytes d = initiation;
    d.resize(size);
    d[1] = std::byte{9};
    write_mac1(mac1_key, d);
    const auto head = read_initiation_head(d, mac1_key);
    EXPECT_EQ(head.fault, HeadFault::kOtherVersion) << size;
    EXPECT_EQ(head.sender_index, 0x11223344u);
    d[10] ^= std::byte{1};
    EXPECT_EQ(read_initiation_head(d, mac1_key).fault, HeadFault::kNotOurs);
  }
}

TEST(Denial, ComesBackAsItWasWrittenAndNothingElseDoes) {
  std::array<std::byte, kDenialBytes> d;
  write_denial({7, DenialReason::kOtherVersion, 0xdeadbeef}, d);
  const auto denial = read_denial(d);
  ASSERT_TRUE(denial);
  EXPECT_EQ(denial->version, 7);
  EXPECT_EQ(denial->reason, DenialReason::kOtherVersion);
  EXPECT_EQ(denial->receiver_index, 0xdeadbeefu);
  for (std::size_t size = 0; size < d.size(); ++size) EXPECT_FALSE(read_denial(std::span(d).first(size)));
  const Bytes longer(9, std::byte{5});
  EXPECT_FALSE(read_denial(longer));
  for (const auto& [at, value] : {std::pair{0, 4}, {2, 0}, {2, 7}, {3, 1}}) {
    auto bad = d;
    bad[static_cast<std::size_t>(at)] = static_cast<std::byte>(value);
    EXPECT_FALSE(read_denial(bad)) << at;
  }
}

}  // namespace
}  // namespace farfeel::transport
