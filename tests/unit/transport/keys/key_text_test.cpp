#include "transport/keys/key_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace farfeel::transport {
namespace {

Key32 key_of(int seed) {
  Key32 key;
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = static_cast<std::byte>(seed * 31 + static_cast<int>(i) * 7);
  return key;
}

TEST(KeyText, ComesBackAsItWas) {
  for (const KeyKind kind : {KeyKind::kPublic, KeyKind::kSecret, KeyKind::kPsk}) {
    for (int i = 0; i < 200; ++i) {
      const Key32 key = i == 0 ? Key32{} : new_key_pair().secret;
      const std::string text = key_to_text(kind, key);
      const auto back = key_from_text(kind, text);
      ASSERT_TRUE(back) << back.error().message;
      EXPECT_EQ(*back, key);
      EXPECT_EQ(text.find_first_of(" +/=\n"), std::string::npos);
    }
  }
}

// What stands in people's files must be readable for ever: computed with Python's base64 and hashlib.
TEST(KeyText, IsWhatItWasWhenTheFirstFilesWereWritten) {
  Key32 key;
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = static_cast<std::byte>(i);
  EXPECT_EQ(key_to_text(KeyKind::kPublic, key), "pub_AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8kK6eV");
  EXPECT_EQ(key_to_text(KeyKind::kSecret, key), "secret_AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh82ELkw");
  EXPECT_EQ(key_to_text(KeyKind::kPsk, key), "psk_AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh_oEN_h");
  EXPECT_EQ(fingerprint(key), "83550 47892 52808 20871 63061 14700");
}

TEST(KeyText, EveryWrongLetterIsTold) {
  const std::string good = key_to_text(KeyKind::kPublic, key_of(1));
  constexpr std::string_view letters = "AQgw09-_ =#\n";
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (const char c : letters) {
      std::string bad = good;
      if (bad[at] == c) continue;
      bad[at] = c;
      EXPECT_FALSE(key_from_text(KeyKind::kPublic, bad)) << bad;
    }
    for (std::size_t other = at + 1; other < good.size(); ++other) {
      std::string swapped = good;
      std::swap(swapped[at], swapped[other]);
      if (swapped != good) {
        EXPECT_FALSE(key_from_text(KeyKind::kPublic, swapped)) << swapped;
      }
    }
    EXPECT_FALSE(key_from_text(KeyKind::kPublic, std::string_view(good).substr(0, at)));
    EXPECT_FALSE(key_from_text(KeyKind::kPublic, std::string_view(good).substr(at + 1)));
  }
  EXPECT_FALSE(key_from_text(KeyKind::kPublic, good + "A"));
}

TEST(KeyText, ASecretIsNoPublicKeyAndTheMessageSaysSo) {
  const auto mixed_up = key_from_text(KeyKind::kPublic, key_to_text(KeyKind::kSecret, key_of(2)));
  ASSERT_FALSE(mixed_up);
  EXPECT_NE(mixed_up.error().message.find("this is a secret key"), std::string::npos) << mixed_up.error().message;
  // Not even with the other's prefix.
  const std::string renamed = "pub_" + key_to_text(KeyKind::kPsk, key_of(2)).substr(4);
  EXPECT_FALSE(key_from_text(KeyKind::kPublic, renamed));
}

TEST(Fingerprint, IsSixGroupsOfFiveDigitsThatDiffer) {
  std::set<std::string> seen;
  for (int i = 0; i < 200; ++i) {
    const std::string text = fingerprint(key_of(i));
    ASSERT_EQ(text.size(), 35u);
    for (std::size_t at = 0; at < text.size(); ++at)
      EXPECT_TRUE(at % 6 == 5 ? text[at] == ' ' : text[at] >= '0' && text[at] <= '9') << text;
    seen.insert(text);
  }
  EXPECT_EQ(seen.size(), 200u);
}

TEST(Name, IsShortAndPlain) {
  for (const char* good : {"a", "anna", "Lab-PC.2_b", "0", "abcdefghijklmnopqrstuvwxyz012345"})
    EXPECT_TRUE(is_name(good));
  for (const char* bad :
       {"", "-a", ".a", "_a", "a b", "a\n", "a#", "\xc3\xa4", "a/b", "abcdefghijklmnopqrstuvwxyz0123456"})
    EXPECT_FALSE(is_name(bad)) << bad;
  EXPECT_EQ(as_name("Anna's PC"), "AnnasPC");
  EXPECT_EQ(as_name("--"), "this-machine");
  EXPECT_TRUE(is_name(as_name(std::string(100, 'x'))));
}

TEST(Date, EndsWithItsDay) {
  EXPECT_EQ(end_of_day_ns("1970-01-01"), 86'400'000'000'000);
  EXPECT_EQ(end_of_day_ns("2027-01-31"), 1'801'440'000'000'000'000);  // date -u -d 2027-02-01 +%s
  EXPECT_EQ(end_of_day_ns("2028-02-29"), 1'835'481'600'000'000'000);  // date -u -d 2028-03-01 +%s
  for (const char* day : {"1970-01-01", "2027-01-31", "2028-02-29", "2261-12-31"})
    EXPECT_EQ(date_ending_at(*end_of_day_ns(day)), day);
  for (const char* bad : {"", "2027-1-31", "2027-02-29", "2027-13-01", "2027-00-10", "2027-01-00", "1969-12-31",
                          "2262-01-01", "31.01.2027", "2027/01/31", "2027-01-31 ", "+027-01-31", "2027-01-3x"}) {
    const auto none = end_of_day_ns(bad);
    ASSERT_FALSE(none) << bad;
    EXPECT_FALSE(none.error().message.empty());
  }
}

}  // namespace
}  // namespace farfeel::transport
