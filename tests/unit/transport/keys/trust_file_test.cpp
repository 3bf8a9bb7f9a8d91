#include "transport/keys/trust_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "transport/keys/key_text.h"

namespace farfeel::transport {
namespace {

const Key32& key(int i) {
  static const std::array<KeyPair, 4> pairs = {new_key_pair(), new_key_pair(), new_key_pair(), new_key_pair()};
  return pairs[static_cast<std::size_t>(i)].public_key;
}
std::string text(int i) {
  return key_to_text(KeyKind::kPublic, key(i));
}

TrustEntry entry(std::string name, int i) {
  TrustEntry e;
  e.name = std::move(name);
  e.public_key = key(i);
  return e;
}

TEST(TrustFile, ReadsEntriesBetweenComments) {
  const Key32 psk = new_key_pair().secret;
  const TrustEntries read =
      read_trust_text(fmt::format("# who\n\n  \t\nanna {}\n\tbert\t{} psk={} expires=2027-01-31 # ward 3\r\n"
                                  "#carl {}",
                                  text(0), text(1), key_to_text(KeyKind::kPsk, psk), text(2)));
  EXPECT_EQ(read.trouble, "");
  ASSERT_EQ(read.entries.size(), 2u);
  EXPECT_EQ(read.entries[0].name, "anna");
  EXPECT_EQ(read.entries[0].public_key, key(0));
  EXPECT_FALSE(read.entries[0].expires_ns);
  EXPECT_FALSE(read.entries[0].psk);
  EXPECT_EQ(read.entries[0].psk_or_zeros(), Key32{});
  EXPECT_EQ(read.entries[1].name, "bert");
  EXPECT_EQ(read.entries[1].psk, psk);
  EXPECT_EQ(read.entries[1].psk_or_zeros(), psk);
  const std::int64_t end_ns = *end_of_day_ns("2027-01-31");
  EXPECT_EQ(read.entries[1].expires_ns, end_ns);
  EXPECT_FALSE(read.entries[1].is_expired(end_ns - 1));
  EXPECT_TRUE(read.entries[1].is_expired(end_ns));
  EXPECT_FALSE(read.entries[0].is_expired(end_ns));
}

TEST(TrustFile, ALineThatCannotBeReadTrustsNobodyAndIsTold) {
  const std::string psk = key_to_text(KeyKind::kPsk, key(3));
  for (const std::string& bad :
       {std::string("bert"), "be/rt " + text(1), "bert " + text(1).substr(1), "bert " + text(1) + " until=2027-01-31",
        "bert " + text(1) + " expires=soon", "bert " + text(1) + " psk=" + text(2),
        "bert " + text(1) + " expires=", "bert " + text(1) + " expires=2027-01-31 expires=2028-01-31",
        "bert " + text(1) + " psk=" + psk + " psk=" + psk, "bert " + text(1) + std::string(2000, ' '),
        "anna " + text(1), "bert " + text(0), std::string("bert ") + '\0' + text(1), "bert " + text(1) + "#x"}) {
    const TrustEntries read = read_trust_text("anna " + text(0) + "\n" + bad + "\ncarl " + text(2));
    EXPECT_EQ(read.trouble.substr(0, 8), "line 2: ") << bad;
    ASSERT_EQ(read.entries.size(), 2u) << bad;
    EXPECT_EQ(read.entries[0].public_key, key(0));
    EXPECT_EQ(read.entries[1].public_key, key(2));
    EXPECT_FALSE(with_entry("anna " + text(0) + "\n" + bad, entry("dora", 3))) << bad;
  }
}

TEST(TrustFile, EntriesAreAddedRenewedAndTakenOutAndCommentsStay) {
  const std::string before = "# first\n\nanna " + text(0) + "   # ward 3\n# last";
  const auto added = with_entry(before, entry("bert", 1));
  ASSERT_TRUE(added) << added.error().message;
  EXPECT_EQ(*added, before + "\nbert  " + text(1) + "\n");

  TrustEntry renewed = entry("anna", 0);
  renewed.expires_ns = *end_of_day_ns("2030-06-01");
  renewed.psk = key(3);
  const auto changed = with_entry(*added, renewed);
  ASSERT_TRUE(changed) << changed.error().message;
  EXPECT_EQ(*changed, "# first\n\nanna  " + text(0) + "  expires=2030-06-01  psk=" +
                          key_to_text(KeyKind::kPsk, key(3)) + "  # ward 3\n# last\nbert  " + text(1) + "\n");
  const TrustEntries read = read_trust_text(*changed);
  ASSERT_EQ(read.entries.size(), 2u);
  EXPECT_EQ(read.entries[0].expires_ns, renewed.expires_ns);
  EXPECT_EQ(read.entries[0].psk, renewed.psk);

  EXPECT_EQ(without_entry(*changed, "anna"), "# first\n\n# last\nbert  " + text(1) + "\n");
  EXPECT_FALSE(without_entry(*changed, "carl"));
  EXPECT_FALSE(without_entry(*changed, ""));
  EXPECT_FALSE(without_entry(*changed, "#"));
  // Whoever is to be out is out, whatever else the line holds.
  EXPECT_EQ(without_entry("anna nonsense\nanna again\nbert\n", "anna"), "bert\n");
}

TEST(TrustFile, NamesAndKeysAreUnique) {
  const std::string before = "anna " + text(0) + "\n";
  const auto other_key = with_entry(before, entry("anna", 1));
  ASSERT_FALSE(other_key);
  EXPECT_EQ(other_key.error().kind, KeysErrorKind::kConflict);
  EXPECT_NE(other_key.error().message.find(fingerprint(key(0))), std::string::npos);
  const auto other_name = with_entry(before, entry("bert", 0));
  ASSERT_FALSE(other_name);
  EXPECT_EQ(other_name.error().kind, KeysErrorKind::kConflict);
  EXPECT_NE(other_name.error().message.find("anna"), std::string::npos);
}

TEST(TrustFile, RolesAreAList) {
  EXPECT_EQ(roles_from_text("operate,edit"), (Roles{true, false, true}));
  EXPECT_EQ(roles_from_text("watch"), (Roles{false, true, false}));
  for (const char* wrong : {"", "all", "watch,", ",watch", "watch,watch", "Watch", "watch edit"})
    EXPECT_FALSE(roles_from_text(wrong)) << wrong;
  TrustEntry entry;
  entry.name = "bert";
  entry.public_key = new_key_pair().public_key;
  EXPECT_EQ(trust_line(entry).find("role="), std::string::npos) << "to operate alone goes without saying";
  entry.roles = {true, true, false};
  const TrustEntries read = read_trust_text(trust_line(entry));
  ASSERT_EQ(read.entries.size(), 1u) << read.trouble;
  EXPECT_EQ(read.entries[0].roles, entry.roles);
  EXPECT_TRUE(read_trust_text(trust_line(entry) + " role=edit").entries.empty()) << "said twice";
}

}  // namespace
}  // namespace farfeel::transport
