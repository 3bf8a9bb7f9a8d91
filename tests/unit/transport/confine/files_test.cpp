#include "transport/confine/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/support/in_child.h"
#include "tests/support/private_folder.h"

namespace farfeel::transport {
namespace {

std::string told(long result) {
  return result >= 0 ? "ok" : std::string(strerrorname_np(errno));
}
std::string opened(const std::string& path, int flags) {
  const int fd = ::open(path.c_str(), flags | O_CLOEXEC, 0600);
  const std::string words = told(fd);
  if (fd >= 0) ::close(fd);
  return words;
}

class FilesTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string why = confined({}, [](int) { return std::string("there"); });
    if (why != "there") GTEST_SKIP() << why;
    for (const char* one : {"/keys", "/cache", "/other"}) {
      std::filesystem::create_directories(folder_ + one);
      std::ofstream(folder_ + one + "/file") << "text";
    }
    std::ofstream(folder_ + "/asset.glb") << "asset";
  }

  static std::string confined(const FileRights& rights, const std::function<std::string(int version)>& work) {
    return test_support::in_child([&] {
             if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return std::string("no_new_privs is refused");
             const auto version = restrict_files(rights);
             return version ? work(*version) : version.error();
           })
        .words;
  }
  [[nodiscard]] FileRights rights() const {
    return {.read = {folder_ + "/keys", folder_ + "/asset.glb", folder_ + "/nowhere"},
            .write = {folder_ + "/cache"},
            .use = {"/dev/null"}};
  }
  [[nodiscard]] std::string with_rights(const std::function<std::string()>& work) const {
    return confined(rights(), [&](int) { return work(); });
  }
  test_support::PrivateFolder private_folder_;
  const std::string folder_ = private_folder_.path();
};

TEST_F(FilesTest, AreReadWhereThatIsAllowed) {
  EXPECT_EQ(with_rights([&] { return opened(folder_ + "/keys/file", O_RDONLY); }), "ok");
  EXPECT_EQ(with_rights([&] { return opened(folder_ + "/asset.glb", O_RDONLY); }), "ok");
  EXPECT_EQ(with_rights([&] { return opened(folder_ + "/cache/file", O_RDWR); }), "ok");
  EXPECT_EQ(with_rights([&] { return opened("/dev/null", O_RDWR); }), "ok");
  for (const std::string& path : {folder_ + "/other/file", folder_, std::string("/etc/passwd"), std::string("/etc")})
    EXPECT_EQ(with_rights([&] { return opened(path, O_RDONLY); }), "EACCES") << path;
  EXPECT_EQ(with_rights([&] { return opened(folder_ + "/keys/../other/file", O_RDONLY); }), "EACCES");
  EXPECT_EQ(with_rights([&] { return opened(folder_ + "/no file", O_RDONLY); }), "ENOENT") << "is told as it is";
}

TEST_F(FilesTest, AreWrittenWhereThatIsAllowed) {
  EXPECT_EQ(with_rights([&] { return opened(folder_ + "/keys/file", O_RDWR); }), "EACCES");
  EXPECT_EQ(with_rights([&] { return opened(folder_ + "/keys/new", O_WRONLY | O_CREAT); }), "EACCES");
  EXPECT_EQ(with_rights([&] { return told(::unlink((folder_ + "/keys/file").c_str())); }), "EACCES");
  EXPECT_EQ(with_rights([&] { return told(::symlink("/etc", (folder_ + "/cache/link").c_str())); }), "EACCES");
  EXPECT_EQ(with_rights([&] {
              const std::string made = folder_ + "/cache/made", final = folder_ + "/cache/final";
              if (const std::string words = opened(made, O_WRONLY | O_CREAT | O_TRUNC); words != "ok") return words;
              if (::rename(made.c_str(), final.c_str()) != 0) return told(-1);
              return told(::unlink(final.c_str()));
            }),
            "ok");
}

// As `farfeel key trust` does while a slave runs: from outside, a new file in place of the old.
TEST_F(FilesTest, ThatAreReplacedInAFolderAreReadAnew) {
  int go[2];
  ASSERT_EQ(::pipe(go), 0);
  const std::string file = folder_ + "/keys/file", next = folder_ + "/keys/next";
  const pid_t outside = ::fork();
  if (outside == 0) {
    char byte = 0;
    if (::read(go[0], &byte, 1) != 1) _exit(1);
    std::ofstream(next) << "replaced";
    _exit(::rename(next.c_str(), file.c_str()) == 0 ? 0 : 1);
  }
  const std::string said = with_rights([&] {
    std::string text;
    std::ifstream(file) >> text;
    if (text != "text" || ::write(go[1], "g", 1) != 1) return std::string("cannot begin");
    for (int i = 0; i < 5000 && text != "replaced"; ++i) {
      ::usleep(1000);
      std::ifstream(file) >> text;
    }
    return text;
  });
  int status = -1;
  ::close(go[1]);
  ::waitpid(outside, &status, 0);
  ::close(go[0]);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(said, "replaced");
}

TEST_F(FilesTest, GoWithTcp) {
  const std::string said = confined(rights(), [](int version) {
    if (version < 4) return fmt::format("Landlock {} knows no network", version);
    const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(9);
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return told(::connect(fd, reinterpret_cast<sockaddr*>(&at), sizeof at));
  });
  if (said.starts_with("Landlock")) GTEST_SKIP() << said;
  EXPECT_EQ(said, "EACCES");
}

TEST_F(FilesTest, HoldForThreadsThatComeLater) {
  EXPECT_EQ(with_rights([&] {
              std::string words;
              std::thread([&] { words = opened("/etc/passwd", O_RDONLY); }).join();
              return words;
            }),
            "EACCES");
}

}  // namespace
}  // namespace farfeel::transport
