#include "codecs/text/whole_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/private_folder.h"

namespace farfeel::codecs {
namespace {

std::string bytes_of(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(WholeFile, LeavesTheOldOneWhereTheNewOneHasNoRoom) {
  const test_support::PrivateFolder folder;
  const std::string path = folder.path() + "/file";
  ASSERT_EQ(write_whole_file(path, "before"), "");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  ::signal(SIGXFSZ, SIG_IGN);
  const rlimit little{1000, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
  const std::string said = write_whole_file(path, std::string(5000, 'x'));
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  ::signal(SIGXFSZ, SIG_DFL);
  EXPECT_NE(said.find(path + ": File too large"), std::string::npos) << said;
  EXPECT_EQ(bytes_of(path), "before");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "a part is left";
  ASSERT_EQ(write_whole_file(path, std::string(5000, 'y')), "");
  EXPECT_EQ(bytes_of(path), std::string(5000, 'y'));
}

TEST(WholeFile, SaysWhatStandsInTheWay) {
  EXPECT_NE(write_whole_file("/nowhere/at/all", "x").find("No such file or directory"), std::string::npos);
  EXPECT_NE(why_not_written("out/summary.json", ENOSPC).find("No space left on device: free some there"),
            std::string::npos);
}

}  // namespace
}  // namespace farfeel::codecs
