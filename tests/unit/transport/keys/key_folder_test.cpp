#include "transport/keys/key_folder.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <thread>

#include "tests/unit/transport/keys/small_files.h"
#include "transport/keys/checked_file.h"
#include "transport/keys/key_text.h"

namespace farfeel::transport {
namespace {

TrustEntry entry(std::string name, const Key32& key) {
  TrustEntry e;
  e.name = std::move(name);
  e.public_key = key;
  return e;
}

struct Environment {
  Environment(const char* n, const std::string& value) : name(n) {
    if (const char* old = std::getenv(n)) before = old;
    setenv(n, value.c_str(), 1);
  }
  ~Environment() { before ? setenv(name, before->c_str(), 1) : unsetenv(name); }
  const char* name;
  std::optional<std::string> before;
};

struct KeyFolderTest : testing::Test {
  KeyFolder made() {
    auto folder = KeyFolder::make(place / "keys");
    EXPECT_TRUE(folder) << folder.error().message;
    return *folder;
  }
  PrivateFolder place;
};

TEST_F(KeyFolderTest, KeepsAnIdentityThatOnlyItsOwnerCanRead) {
  const KeyFolder folder = made();
  EXPECT_EQ(mode_of(folder.path()), 0700);
  const auto none = folder.identity();
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, KeysErrorKind::kMissing);
  EXPECT_NE(none.error().message.find("farfeel key new"), std::string::npos);

  const auto pair = folder.make_identity();
  ASSERT_TRUE(pair) << pair.error().message;
  EXPECT_EQ(mode_of(folder.path() + "/identity"), 0600);
  const auto again = KeyFolder::open(folder.path())->identity();
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->secret, pair->secret);
  EXPECT_EQ(again->public_key, pair->public_key);

  const auto twice = folder.make_identity();
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().kind, KeysErrorKind::kConflict);
  EXPECT_EQ(folder.identity()->secret, pair->secret);
}

TEST_F(KeyFolderTest, EveryBitThatLetsOthersInIsRefusedWithTheCommandThatMendsIt) {
  const KeyFolder folder = made();
  ASSERT_TRUE(folder.make_identity());
  const std::string identity = folder.path() + "/identity";
  for (const mode_t bit : {001, 002, 004, 010, 020, 040}) {
    chmod(identity.c_str(), 0600 | bit);
    const auto refused = folder.identity();
    ASSERT_FALSE(refused) << bit;
    EXPECT_EQ(refused.error().kind, KeysErrorKind::kPermissions);
    EXPECT_NE(refused.error().message.find("chmod 600 '" + identity + "'"), std::string::npos);
    chmod(identity.c_str(), 0600);
    chmod(folder.path().c_str(), 0700 | bit);
    const auto open = KeyFolder::open(folder.path());
    ASSERT_FALSE(open) << bit;
    EXPECT_EQ(open.error().kind, KeysErrorKind::kPermissions);
    EXPECT_NE(open.error().message.find("chmod 700 '" + folder.path() + "'"), std::string::npos);
    chmod(folder.path().c_str(), 0700);
  }
  EXPECT_TRUE(KeyFolder::open(folder.path())->identity());
}

TEST_F(KeyFolderTest, WhatBelongsToAnotherUserIsRefused) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give a file away";
  const KeyFolder folder = made();
  ASSERT_TRUE(folder.make_identity());
  ASSERT_EQ(chown((folder.path() + "/identity").c_str(), 12345, static_cast<gid_t>(-1)), 0);
  EXPECT_EQ(folder.identity().error().kind, KeysErrorKind::kPermissions);
  ASSERT_EQ(chown(folder.path().c_str(), 12345, static_cast<gid_t>(-1)), 0);
  const auto open = KeyFolder::open(folder.path());
  ASSERT_FALSE(open);
  EXPECT_NE(open.error().message.find("belongs to user 12345"), std::string::npos);
}

TEST_F(KeyFolderTest, ABrokenIdentityIsToldWithItsPath) {
  const KeyFolder folder = made();
  const std::string secret = key_to_text(KeyKind::kSecret, new_key_pair().secret);
  for (const std::string& bad :
       {std::string(), std::string("# nothing\n"), secret.substr(1), secret + "\n" + secret + "\n",
        key_to_text(KeyKind::kPublic, new_key_pair().public_key)}) {
    put(folder.path() + "/identity", bad);
    const auto refused = folder.identity();
    ASSERT_FALSE(refused) << bad;
    EXPECT_EQ(refused.error().kind, KeysErrorKind::kMalformed);
    EXPECT_NE(refused.error().message.find(folder.path() + "/identity"), std::string::npos);
  }
  put(folder.path() + "/identity", "# kept\r\n\r\n" + secret + " \r\n");
  EXPECT_TRUE(folder.identity());
}

TEST_F(KeyFolderTest, TrustsAndRevokesByRole) {
  const KeyFolder folder = made();
  const Key32 anna = new_key_pair().public_key;
  ASSERT_TRUE(folder.trust(Role::kOperator, entry("anna", anna)));
  EXPECT_EQ(mode_of(folder.path_of(Role::kOperator)), 0600);
  EXPECT_EQ(folder.trusted(Role::kOperator)->find(anna, 0).standing, TrustList::Standing::kTrusted);
  EXPECT_EQ(folder.trusted(Role::kSlave)->find(anna, 0).standing, TrustList::Standing::kUnknown);
  EXPECT_EQ(folder.revoke(Role::kSlave, "anna"), false);
  EXPECT_EQ(folder.revoke(Role::kOperator, "anna"), true);
  EXPECT_EQ(folder.revoke(Role::kOperator, "anna"), false);
  EXPECT_EQ(folder.trusted(Role::kOperator)->find(anna, 0).standing, TrustList::Standing::kUnknown);
  EXPECT_EQ(got(folder.path_of(Role::kOperator)).substr(0, 5), "# Who") << "comments stay";
}

TEST_F(KeyFolderTest, TwoProgramsAtOnceLoseNothing) {
  const KeyFolder folder = made();
  constexpr int kPrograms = 4, kEach = 25;
  std::array<pid_t, kPrograms> children{};
  for (int p = 0; p < kPrograms; ++p) {
    children[static_cast<std::size_t>(p)] = fork();
    if (children[static_cast<std::size_t>(p)] == 0) {
      bool ok = true;
      for (int i = 0; i < kEach; ++i) {
        ok = ok && folder.trust(Role::kOperator, entry(fmt::format("n{}-{}", p, i), new_key_pair().public_key));
        ok = ok && folder.trust(Role::kOperator, entry(fmt::format("gone{}", p), new_key_pair().public_key));
        ok = ok && folder.revoke(Role::kOperator, fmt::format("gone{}", p)).value_or(false);
      }
      _exit(ok ? 0 : 1);
    }
  }
  for (const pid_t child : children) {
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
  }
  const auto list = folder.trusted(Role::kOperator);
  ASSERT_TRUE(list) << list.error().message;
  EXPECT_EQ(list->entries().size(), std::size_t{kPrograms * kEach});
}

// Whoever reads while others write sees a whole list, old or new.
TEST_F(KeyFolderTest, AReaderNeverSeesHalfAList) {
  const KeyFolder folder = made();
  const Key32 anna = new_key_pair().public_key, bert = new_key_pair().public_key;
  ASSERT_TRUE(folder.trust(Role::kOperator, entry("anna", anna)));
  const pid_t writer = fork();
  if (writer == 0) {
    for (int i = 0; i < 100; ++i) {
      (void)folder.trust(Role::kOperator, entry("bert", bert));
      (void)folder.revoke(Role::kOperator, "bert");
    }
    _exit(0);
  }
  auto list = folder.trusted(Role::kOperator);
  ASSERT_TRUE(list);
  int status = -1, looks = 0;
  while (waitpid(writer, &status, WNOHANG) == 0) {
    (void)list->refresh();
    EXPECT_EQ(list->trouble(), "");
    ASSERT_EQ(list->find(anna, 0).standing, TrustList::Standing::kTrusted);
    ++looks;
  }
  EXPECT_GT(looks, 0);
}

TEST_F(KeyFolderTest, AWriterThatDiedHalfWayIsNoTrouble) {
  const KeyFolder folder = made();
  put(folder.path_of(Role::kOperator) + ".new", "half a li");
  const Key32 anna = new_key_pair().public_key;
  ASSERT_TRUE(folder.trust(Role::kOperator, entry("anna", anna)));
  EXPECT_EQ(folder.trusted(Role::kOperator)->entries().size(), 1u);
}

TEST_F(KeyFolderTest, LoopbackProgramsMeetInOneFolder) {
  const Environment runtime("XDG_RUNTIME_DIR", place.path());
  constexpr int kPrograms = 6;
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  for (int p = 0; p < kPrograms; ++p) {
    if (fork() == 0) {
      const auto folder = KeyFolder::open_loopback();
      Key32 key{};
      if (folder)
        if (const auto pair = folder->identity(); pair &&
                                                  folder->trusted(Role::kOperator)->find(pair->public_key, 0).entry &&
                                                  folder->trusted(Role::kSlave)->find(pair->public_key, 0).entry)
          key = pair->public_key;
      _exit(write(ends[1], key.data(), key.size()) == 32 ? 0 : 1);
    }
  }
  const auto own = KeyFolder::open_loopback();
  ASSERT_TRUE(own) << own.error().message;
  EXPECT_EQ(own->path(), place / "farfeel/loopback");
  EXPECT_EQ(mode_of(own->path()), 0700);
  EXPECT_EQ(mode_of(own->path() + "/identity"), 0600);
  for (int p = 0; p < kPrograms; ++p) {
    Key32 key{};
    ASSERT_EQ(read(ends[0], key.data(), key.size()), 32);
    EXPECT_EQ(key, own->identity()->public_key);
    wait(nullptr);
  }
  close(ends[0]);
  close(ends[1]);
}

TEST_F(KeyFolderTest, ARuntimeFolderThatIsNotThereOrNotOursIsNotUsed) {
  const std::string own = fmt::format("/tmp/farfeel-{}/farfeel/loopback", geteuid());
  {
    const Environment runtime("XDG_RUNTIME_DIR", place / "none");
    const auto folder = KeyFolder::open_loopback();
    ASSERT_TRUE(folder) << folder.error().message;
    EXPECT_EQ(folder->path(), own);
  }
  if (geteuid() != 0) GTEST_SKIP() << "only root can give a folder away";
  ASSERT_EQ(chown(place.path().c_str(), 12345, static_cast<gid_t>(-1)), 0);
  const Environment runtime("XDG_RUNTIME_DIR", place.path());
  EXPECT_EQ(KeyFolder::open_loopback()->path(), own);
  EXPECT_FALSE(std::filesystem::exists(place / "farfeel"));
}

TEST_F(KeyFolderTest, ALoopbackFolderThatOthersMayEnterIsRefused) {
  const Environment runtime("XDG_RUNTIME_DIR", place.path());
  std::filesystem::create_directories(place / "farfeel/loopback");
  chmod((place / "farfeel").c_str(), 0777);
  const auto refused = KeyFolder::open_loopback();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, KeysErrorKind::kPermissions);
}

TEST_F(KeyFolderTest, StandsWhereTheUsersSettingsAre) {
  {
    const Environment config("XDG_CONFIG_HOME", "/somewhere");
    EXPECT_EQ(default_key_folder(), "/somewhere/farfeel/keys");
  }
  const Environment config("XDG_CONFIG_HOME", ""), home("HOME", "/home/anna");
  EXPECT_EQ(default_key_folder(), "/home/anna/.config/farfeel/keys");
  const Environment homeless("HOME", "");
  EXPECT_FALSE(default_key_folder());
}

TEST_F(KeyFolderTest, AListAsLongAsAFileMayBeIsReadAndALongerOneIsNot) {
  const std::string path = place / "operators";
  put(path, std::string(kKeyFileBytesMax, '\n'));
  EXPECT_TRUE(read_private_file(path));
  put(path, std::string(kKeyFileBytesMax + 1, '\n'));
  EXPECT_EQ(read_private_file(path).error().kind, KeysErrorKind::kMalformed);
}

}  // namespace
}  // namespace farfeel::transport
