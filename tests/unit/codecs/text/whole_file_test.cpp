#include "codecs/text/whole_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

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

TEST(WholeFile, AStopAmidTheWriteLeavesNothingBeside) {
  const test_support::PrivateFolder folder;
  const std::string path = folder.path() + "/file", bytes(32 << 20, 'x');
  for (int time = 0; time < 10; ++time) {
    const pid_t writer = ::fork();
    if (writer == 0) {
      ::signal(SIGINT, SIG_DFL);  // a shell may have started the test with it ignored
      while (write_whole_file(path, bytes).empty()) continue;
      _exit(0);
    }
    while (!std::filesystem::exists(path)) ::usleep(1000);  // it writes all the time from now on
    ::usleep(static_cast<useconds_t>(3000 * time));
    ::kill(writer, time % 2 == 0 ? SIGINT : SIGTERM);
    int status = 0;
    ASSERT_EQ(::waitpid(writer, &status, 0), writer);
    EXPECT_TRUE(WIFSIGNALED(status)) << status;
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "a part is left";
    EXPECT_EQ(std::filesystem::file_size(path), bytes.size());
  }
}

TEST(WholeFile, SaysWhatStandsInTheWay) {
  EXPECT_NE(write_whole_file("/nowhere/at/all", "x").find("No such file or directory"), std::string::npos);
  EXPECT_NE(why_not_written("out/summary.json", ENOSPC).find("No space left on device: free some there"),
            std::string::npos);
}

}  // namespace
}  // namespace farfeel::codecs
