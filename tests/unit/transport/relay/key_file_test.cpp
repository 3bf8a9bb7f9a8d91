#include "transport/relay/key_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "tests/support/private_folder.h"

namespace farfeel::transport {
namespace {

class RelayKeyFile : public testing::Test {
 protected:
  test_support::PrivateFolder private_folder_;
  const std::string folder_ = private_folder_.path();
  const std::string path_ = folder_ + "/deeper/relay.key";
};

TEST_F(RelayKeyFile, IsMadeOnceAndForItsUserAlone) {
  const auto made = read_or_make_relay_key(path_);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(read_or_make_relay_key(path_).value(), *made);
  struct stat status {};
  ASSERT_EQ(stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
  EXPECT_NE(read_or_make_relay_key(folder_ + "/another").value(), *made);
}

TEST_F(RelayKeyFile, IsRefusedWhereOthersReadIt) {
  ASSERT_TRUE(read_or_make_relay_key(path_));
  for (const mode_t mode : {0644u, 0640u, 0620u, 0604u}) {
    ASSERT_EQ(chmod(path_.c_str(), mode), 0);
    const auto key = read_or_make_relay_key(path_);
    ASSERT_FALSE(key) << mode;
    EXPECT_EQ(key.error().kind, ErrorKind::kRefused);
    EXPECT_NE(key.error().message.find("chmod 600"), std::string::npos);
  }
}

TEST_F(RelayKeyFile, IsRefusedWhereItIsNoKey) {
  ASSERT_TRUE(read_or_make_relay_key(path_));
  for (const std::string& text :
       {std::string(), std::string("\n"), std::string(64, 'g') + "\n", std::string(63, 'a') + "\n",
        std::string(65, 'a') + "\n", std::string(64, 'a'), std::string(64, 'A') + "\n"}) {
    std::ofstream(path_, std::ios::trunc) << text;
    const auto key = read_or_make_relay_key(path_);
    ASSERT_FALSE(key) << text;
    EXPECT_EQ(key.error().kind, ErrorKind::kAddress);
  }
}

TEST_F(RelayKeyFile, SaysWhereItCannotBeMade) {
  std::ofstream(folder_ + "/file") << "x";
  const auto key = read_or_make_relay_key(folder_ + "/file/relay.key");
  ASSERT_FALSE(key);
  EXPECT_EQ(key.error().kind, ErrorKind::kSocket);
}

}  // namespace
}  // namespace farfeel::transport
