#include "transport/relay/relay_messages.h"

#include <gtest/gtest.h>

#include <vector>

namespace farfeel::transport {
namespace {

Mac16 mac(int fill) {
  Mac16 m;
  m.fill(static_cast<std::byte>(fill));
  return m;
}

Key32 key() {
  Key32 k{};
  k[3] = std::byte{9};
  return k;
}

std::vector<std::byte> registered(const std::optional<Address>& peer) {
  std::vector<std::byte> bytes(RegisteredMessage::kBytes);
  write(RegisteredMessage{1, 7, mac(1), parse_address("203.0.113.1:40000").value(), peer, mac(2)}, key(), bytes);
  return bytes;
}

TEST(RelayMessages, AreReadAsTheyWereWritten) {
  std::vector<std::byte> bytes(RegisterMessage::kBytes);
  const RegisterMessage r{RelayRole::kSlave, 3, 0x0102030405060708, 99, {1, 2, 3, 4}, mac(5), mac(6)};
  write(r, key(), bytes);
  const auto read = read_register(bytes);
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->role == r.role && read->slot == r.slot && read->nonce == r.nonce && read->instance == r.instance &&
              read->grant == r.grant && read->room == r.room && read->cookie == r.cookie);
  EXPECT_TRUE(is_signed(bytes, key()));
  EXPECT_EQ(bytes[0], std::byte{16});
  EXPECT_EQ(bytes[4], std::byte{8}) << "the nonce, least byte first, stands at 4";

  for (const char* text : {"", "198.51.100.7:1", "[2001:db8::9]:65535"}) {
    const auto peer = *text ? std::optional(parse_address(text).value()) : std::nullopt;
    const auto message = read_registered(registered(peer));
    ASSERT_TRUE(message) << text;
    EXPECT_EQ(message->peer, peer);
    EXPECT_EQ(to_string(message->own), "203.0.113.1:40000");
    EXPECT_TRUE(message->slot == 1 && message->nonce == 7 && message->cookie == mac(1) &&
                message->probe_secret == mac(2));
  }

  bytes.resize(ChallengeMessage::kBytes);
  write(ChallengeMessage{5, mac(3)}, bytes);
  EXPECT_TRUE(read_challenge(bytes)->nonce == 5 && read_challenge(bytes)->cookie == mac(3));
  bytes.resize(RefusedMessage::kBytes);
  write(RefusedMessage{RelayRefusal::kFull, 6, -5}, bytes);
  EXPECT_TRUE(read_refused(bytes)->reason == RelayRefusal::kFull && read_refused(bytes)->nonce == 6 &&
              read_refused(bytes)->wall_clock_s == -5);
  bytes.resize(ProbeMessage::kBytes);
  write(ProbeMessage{2, true, mac(4)}, bytes);
  EXPECT_TRUE(read_probe(bytes)->slot == 2 && read_probe(bytes)->has_heard && read_probe(bytes)->secret == mac(4));
}

TEST(RelayMessages, AreSmallerAsAnswers) {
  EXPECT_LE(ChallengeMessage::kBytes, RegisterMessage::kBytes);
  EXPECT_LE(RegisteredMessage::kBytes, RegisterMessage::kBytes);
  EXPECT_LE(RefusedMessage::kBytes, RegisterMessage::kBytes);
}

TEST(RelayMessages, AreNotSignedAnyMoreOnceAByteChanged) {
  std::vector<std::byte> one(RegisterMessage::kBytes), two = registered(parse_address("198.51.100.7:1").value());
  write(RegisterMessage{}, key(), one);
  for (auto* message : {&one, &two}) {
    ASSERT_TRUE(is_signed(*message, key()));
    for (std::byte& byte : *message)
      for (int bit = 0; bit < 8; ++bit) {
        byte ^= std::byte{1} << bit;
        EXPECT_FALSE(is_signed(*message, key()));
        byte ^= std::byte{1} << bit;
      }
    EXPECT_FALSE(is_signed(*message, Key32{}));
  }
}

TEST(RelayMessages, AreOfTheirLengthAndVersion) {
  const auto check = [](std::vector<std::byte> bytes, auto read) {
    ASSERT_TRUE(read(bytes));
    for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(read(std::span(bytes).first(size))) << size;
    bytes[1] = std::byte{2};
    EXPECT_FALSE(read(bytes));
    bytes[1] = std::byte{1};
    for (int type = 0; type < 256; ++type) {
      const std::byte own = bytes[0];
      bytes[0] = static_cast<std::byte>(type);
      EXPECT_EQ(read(bytes).has_value(), bytes[0] == own);
      bytes[0] = own;
    }
    bytes.push_back(std::byte{0});
    EXPECT_FALSE(read(bytes));
  };
  std::vector<std::byte> bytes(RegisterMessage::kBytes);
  write(RegisterMessage{}, key(), bytes);
  check(bytes, [](auto b) { return read_register(b); });
  check(registered({}), [](auto b) { return read_registered(b); });
  bytes.assign(ChallengeMessage::kBytes, {});
  write(ChallengeMessage{}, bytes);
  check(bytes, [](auto b) { return read_challenge(b); });
  bytes.assign(RefusedMessage::kBytes, {});
  write(RefusedMessage{}, bytes);
  check(bytes, [](auto b) { return read_refused(b); });
  bytes.assign(ProbeMessage::kBytes, {});
  write(ProbeMessage{}, bytes);
  check(bytes, [](auto b) { return read_probe(b); });
}

TEST(RelayMessages, AreNotTheLinks) {
  for (int type = 0; type < 256; ++type) {
    const std::byte first = static_cast<std::byte>(type);
    EXPECT_EQ(relay_type({&first, 1}).has_value(), type >= 16);
  }
  EXPECT_FALSE(relay_type({}));
}

}  // namespace
}  // namespace farfeel::transport
