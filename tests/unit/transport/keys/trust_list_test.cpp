#include "transport/keys/trust_list.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <utility>

#include "tests/unit/transport/keys/small_files.h"
#include "transport/keys/checked_file.h"
#include "transport/keys/key_text.h"

namespace farfeel::transport {
namespace {

using Standing = TrustList::Standing;

struct TrustListTest : testing::Test {
  std::string line(const std::string& name, int i, const std::string& more = "") {
    return fmt::format("{} {} {}\n", name, key_to_text(KeyKind::kPublic, keys[static_cast<std::size_t>(i)].public_key),
                       more);
  }
  Standing standing(int i, std::int64_t now_ns = 0) {
    return list->find(keys[static_cast<std::size_t>(i)].public_key, now_ns).standing;
  }
  void open() {
    auto opened = TrustList::open(path);
    ASSERT_TRUE(opened) << opened.error().message;
    list.emplace(std::move(*opened));
  }

  PrivateFolder folder;
  std::string path = folder / "operators";
  std::array<KeyPair, 3> keys = {new_key_pair(), new_key_pair(), new_key_pair()};
  std::optional<TrustList> list;
};

TEST_F(TrustListTest, FindsWhoIsTrustedExpiredAndUnknown) {
  put(path, line("anna", 0) + line("bert", 1, "expires=2027-01-31"));
  open();
  const std::int64_t end_ns = *end_of_day_ns("2027-01-31");
  EXPECT_EQ(standing(0, end_ns), Standing::kTrusted);
  EXPECT_EQ(standing(1, end_ns - 1), Standing::kTrusted);
  EXPECT_EQ(standing(1, end_ns), Standing::kExpired);
  EXPECT_EQ(list->find(keys[1].public_key, end_ns).entry->name, "bert");
  EXPECT_EQ(standing(2), Standing::kUnknown);
  EXPECT_EQ(list->find(keys[2].public_key, 0).entry, nullptr);
  ASSERT_NE(list->find_name("anna"), nullptr);
  EXPECT_EQ(list->find_name("anna")->public_key, keys[0].public_key);
  EXPECT_EQ(list->find_name("carl"), nullptr);
}

TEST_F(TrustListTest, SeesEveryChangeHoweverFastTheyFollow) {
  put(path, line("anna", 0));
  open();
  // The same size each time, in place and by renaming, many within one tick of the file system's clock.
  for (int i = 0; i < 200; ++i) {
    const int now = i % 2;
    if (i % 4 < 2)
      put(path, line("anna", now));
    else
      ASSERT_TRUE(write_private_file(path, line("anna", now)));
    EXPECT_TRUE(list->refresh());
    EXPECT_EQ(standing(now), Standing::kTrusted) << i;
    EXPECT_EQ(standing(1 - now), Standing::kUnknown) << i;
  }
}

TEST_F(TrustListTest, DoesNotReadAFileThatRests) {
  put(path, line("anna", 0));
  const timespec long_ago[2] = {{1000, 0}, {1000, 0}};
  ASSERT_EQ(utimensat(AT_FDCWD, path.c_str(), long_ago, 0), 0);
  open();
  // When it changed last is the kernel's to say, and it says just now: the list settles within some looks.
  int reads = 0;
  for (int i = 0; i < 30 && (i == 0 || list->refresh()); ++i, ++reads) usleep(100'000);
  EXPECT_LT(reads, 30);
  EXPECT_FALSE(list->refresh());
  EXPECT_EQ(standing(0), Standing::kTrusted);
  put(path, line("bert", 1));
  EXPECT_TRUE(list->refresh());
  EXPECT_EQ(standing(0), Standing::kUnknown);
}

TEST_F(TrustListTest, NobodyIsTrustedWhereTheFileIsGone) {
  open();
  EXPECT_TRUE(list->entries().empty());
  put(path, line("anna", 0));
  EXPECT_TRUE(list->refresh());
  EXPECT_EQ(standing(0), Standing::kTrusted);
  std::filesystem::remove(path);
  EXPECT_TRUE(list->refresh());
  EXPECT_EQ(standing(0), Standing::kUnknown);
  EXPECT_EQ(list->trouble(), "");
}

TEST_F(TrustListTest, NobodyIsTrustedWhereTheFolderIsGone) {
  put(path, line("anna", 0));
  open();
  std::filesystem::remove_all(folder.path());
  EXPECT_TRUE(list->refresh());
  EXPECT_EQ(standing(0), Standing::kUnknown);
}

TEST_F(TrustListTest, ABrokenFileAddsNobodyAndTakesOutWhoIsNotInItAnyMore) {
  put(path, line("anna", 0) + line("bert", 1));
  open();
  put(path, line("bert", 1) + line("carl", 2) + "not a line\n");
  EXPECT_TRUE(list->refresh());
  EXPECT_EQ(standing(0), Standing::kUnknown) << "revoked";
  EXPECT_EQ(standing(1), Standing::kTrusted);
  EXPECT_EQ(standing(2), Standing::kUnknown) << "new, in a file that is not right";
  EXPECT_NE(list->trouble().find(path + ", line 3: "), std::string::npos) << list->trouble();
  put(path, line("bert", 1) + line("carl", 2));
  EXPECT_TRUE(list->refresh());
  EXPECT_EQ(standing(2), Standing::kTrusted);
  EXPECT_EQ(list->trouble(), "");
}

TEST_F(TrustListTest, AFileThatOthersMayUseAddsNobodyAndSaysSo) {
  put(path, line("anna", 0));
  open();
  put(path, line("anna", 0) + line("carl", 2));
  chmod(path.c_str(), 0644);
  EXPECT_TRUE(list->refresh());
  EXPECT_EQ(standing(0), Standing::kTrusted);
  EXPECT_EQ(standing(2), Standing::kUnknown);
  EXPECT_NE(list->trouble().find("chmod 600 '" + path + "'"), std::string::npos) << list->trouble();
  EXPECT_FALSE(list->refresh()) << "the same trouble is no news";
  chmod(path.c_str(), 0600);
  EXPECT_TRUE(list->refresh());
  EXPECT_EQ(standing(2), Standing::kTrusted);
  EXPECT_EQ(list->trouble(), "");
}

TEST_F(TrustListTest, DoesNotBeginWithAFileThatIsNotRight) {
  put(path, line("anna", 0) + "bert\n");
  const auto broken = TrustList::open(path);
  ASSERT_FALSE(broken);
  EXPECT_NE(broken.error().message.find("line 2"), std::string::npos);
  put(path, line("anna", 0));
  chmod(path.c_str(), 0660);
  EXPECT_EQ(TrustList::open(path).error().kind, KeysErrorKind::kPermissions);
  std::filesystem::remove(path);
  std::filesystem::create_directory(path);
  EXPECT_FALSE(TrustList::open(path));
}

}  // namespace
}  // namespace farfeel::transport
