#include "transport/relay/relay_token.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace farfeel::transport {
namespace {

RelayToken sample() {
  Key32 key{};
  key[0] = std::byte{1};
  return make_token(key, {0x1122334455667788, 1'800'000'000, 20'000, 4});
}

TEST(RelayToken, IsReadFromItsText) {
  const std::string text = to_string(sample());
  EXPECT_EQ(text.size(), 14u + 75u);
  EXPECT_EQ(parse_token(text).value(), sample());
  EXPECT_EQ(parse_token("  " + text + "\n").value(), sample());
}

TEST(RelayToken, HasAKeyThatTheGrantDecides) {
  Key32 key{};
  key[0] = std::byte{1};
  const RelayToken token = sample();
  for (int field = 0; field < 4; ++field) {
    RelayGrant other = token.grant;
    (field == 0 ? other.id : other.expiry_s) += field < 2 ? 1 : 0;
    if (field == 2) ++other.rate_kbit;
    if (field == 3) ++other.most_ends;
    EXPECT_NE(make_token(key, other).key, token.key) << field;
  }
  key[31] = std::byte{1};
  EXPECT_NE(make_token(key, token.grant).key, token.key) << "another relay's";
}

TEST(RelayToken, IsNotReadFromAnythingElse) {
  const std::string text = to_string(sample());
  for (const std::string& wrong :
       {std::string(), std::string(" "), text + "A", text.substr(0, text.size() - 1), "X" + text.substr(1),
        std::string(text).replace(40, 1, "+"), std::string(text).replace(text.size() - 1, 1, "_"), text + " x"}) {
    const auto token = parse_token(wrong);
    ASSERT_FALSE(token) << wrong;
    EXPECT_NE(token.error().message.find("farfeel-relay token"), std::string::npos);
    EXPECT_EQ(token.error().message.find(text.substr(60, 20)), std::string::npos) << "a secret is not repeated";
  }
}

TEST(RelayToken, KeepsRoomsOfDifferentTokensApart) {
  RelayToken other = sample();
  other.key[5] ^= std::byte{1};
  EXPECT_EQ(room_id(sample(), "lab"), room_id(sample(), "lab"));
  EXPECT_NE(room_id(sample(), "lab"), room_id(sample(), "lab "));
  EXPECT_NE(room_id(sample(), "lab"), room_id(other, "lab"));
}

TEST(KeyedHash, IsBlake2b) {
  // By another implementation: python3 -c "import hashlib; print(hashlib.blake2b(bytes(range(3)),
  // key=bytes(range(32)), digest_size=16).hexdigest())", and with digest_size=32.
  Key32 key;
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = static_cast<std::byte>(i);
  const std::array<std::byte, 3> message{std::byte{0}, std::byte{1}, std::byte{2}};
  const auto hex = [](std::span<const std::byte> bytes) {
    std::string text;
    for (const std::byte b : bytes)
      for (const int shift : {4, 0}) text += "0123456789abcdef"[std::to_integer<int>(b) >> shift & 15];
    return text;
  };
  EXPECT_EQ(hex(keyed_mac(key, message)), "194701a386811588a35d83be1f36769c");
  EXPECT_EQ(hex(derived_key(key, message)), "e14fc9161564dd081204f2dd6146a9ffbef66f95d5dc80e0a225e213c09dad7b");
}

}  // namespace
}  // namespace farfeel::transport
