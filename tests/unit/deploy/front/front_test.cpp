#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "deploy/front/build_tree.h"
#include "deploy/front/child.h"
#include "deploy/front/progress.h"
#include "tests/support/private_folder.h"

namespace farfeel::front {
namespace {

TEST(Progress, IsReadFromTheMastersLine) {
  const auto p = progress_from("progress t=3.2 of=20 state=touching force=2.31 contacts=4 rtt=nan later=1");
  ASSERT_TRUE(p);
  EXPECT_EQ(p->t_s, 3.2);
  EXPECT_EQ(p->of_s, 20);
  EXPECT_EQ(p->state, "touching");
  EXPECT_EQ(p->force_N, 2.31);
  EXPECT_EQ(p->contacts, 4);
  EXPECT_TRUE(std::isnan(p->rtt_ms));
  EXPECT_EQ(shown(*p), "  3.2 of 20 s [###.................] touching  2.31 N   4 contacts  rtt -");
  EXPECT_FALSE(progress_from("scene received"));
  EXPECT_TRUE(progress_from("progress "));
  for (const char* odd : {"progress t= of", "progress =", "progress t=x  of=-1", "progress t=1e400 of=1"}) {
    const auto broken = progress_from(odd);
    ASSERT_TRUE(broken);
    EXPECT_FALSE(shown(*broken).empty());
  }
}

class ChildTest : public testing::Test {
 protected:
  tl::expected<Child, FrontError> shell(const std::string& script, bool has_ready = false) {
    return Child::start("/bin/sh", {"-c", script}, log(), Child::Output::kIsRead, has_ready);
  }
  [[nodiscard]] std::string log() const { return folder_ / "log"; }
  test_support::PrivateFolder folder_;
  static bool ends_within(Child& child, int milliseconds) {
    pollfd ended{child.ended_fd(), POLLIN, 0};
    return poll(&ended, 1, milliseconds) == 1 && child.status();
  }
};

TEST_F(ChildTest, SaysWhereItIsReady) {
  auto child = shell("echo ready 47001 >&3; exec sleep 1000", true);
  ASSERT_TRUE(child) << child.error().message;
  const auto port = child->ready_port(10, -1);
  ASSERT_TRUE(port) << port.error().message;
  EXPECT_EQ(*port, 47001);
  EXPECT_FALSE(child->status());
  child->signal(SIGTERM);
  EXPECT_TRUE(ends_within(*child, 10'000));
  EXPECT_EQ(child->status(), 128 + SIGTERM);
}

TEST_F(ChildTest, LeavesItsLastWordsWhenItFails) {
  auto child = shell("for i in 1 2 3 4 5 6 7 8 9 10; do echo line $i >&2; done; exit 3", true);
  ASSERT_TRUE(child);
  EXPECT_FALSE(child->ready_port(10, -1));
  const std::string obituary = child->obituary();
  EXPECT_NE(obituary.find("sh ended with status 3"), std::string::npos) << obituary;
  EXPECT_NE(obituary.find("line 10"), std::string::npos) << obituary;
  EXPECT_EQ(obituary.find("line 2\n"), std::string::npos) << obituary;
  auto killed = shell("kill -9 $$");
  ASSERT_TRUE(killed);
  ASSERT_TRUE(ends_within(*killed, 10'000));
  EXPECT_NE(killed->obituary().find("signal 9"), std::string::npos);
}

TEST_F(ChildTest, IsGoneBeforeItIsCalledEnded) {
  auto child = shell("exec 3>&-; sleep 0.1; exit 3", true);  // closes what it would be ready on, and takes its time
  ASSERT_TRUE(child);
  EXPECT_FALSE(child->ready_port(10, -1));
  EXPECT_EQ(child->status(), 3);
}

TEST_F(ChildTest, IsEndedWithItsOwner) {
  pid_t pid = 0;
  {
    auto child = shell("trap '' TERM; echo ready $$ >&3; while :; do sleep 0.01; done", true);
    ASSERT_TRUE(child);
    pid = *child->ready_port(10, -1);
    ASSERT_EQ(kill(pid, 0), 0);
  }
  EXPECT_NE(kill(pid, 0), 0) << "even one that ignores SIGTERM";
}

// A front that is killed has no chance to end anybody: the kernel does it.
TEST_F(ChildTest, DoesNotOutliveAFrontThatIsKilled) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const pid_t front = fork();
  if (front == 0) {
    auto child = shell("echo ready $$ >&3; exec sleep 1000", true);
    const int pid = child ? child->ready_port(10, -1).value_or(-1) : -1;
    if (write(ends[1], &pid, sizeof pid) < 0) _exit(1);
    for (;;) pause();
  }
  int pid = -1;
  ASSERT_EQ(read(ends[0], &pid, sizeof pid), static_cast<ssize_t>(sizeof pid));
  ASSERT_GT(pid, 0);
  kill(front, SIGKILL);
  waitpid(front, nullptr, 0);
  bool is_gone = false;
  for (int i = 0; i < 1000 && !is_gone; ++i) {
    is_gone = kill(pid, 0) != 0;
    // Where nobody adopts orphans, what is left is a zombie.
    std::array<char, 64> stat{};
    if (std::FILE* file = std::fopen(("/proc/" + std::to_string(pid) + "/stat").c_str(), "r")) {
      is_gone = is_gone || (std::fread(stat.data(), 1, stat.size() - 1, file) > 0 &&
                            std::string_view(stat.data()).find(") Z") != std::string_view::npos);
      std::fclose(file);
    }
    if (!is_gone) poll(nullptr, 0, 10);
  }
  EXPECT_TRUE(is_gone);
  close(ends[0]);
  close(ends[1]);
}

TEST_F(ChildTest, WaitsNoLongerThanItMust) {
  auto silent = shell("exec sleep 1000", true);
  ASSERT_TRUE(silent);
  EXPECT_NE(silent->ready_port(0.01, -1).error().message.find("not ready"), std::string::npos);
  auto talkative = shell("echo soon >&3; exec sleep 1000", true);
  ASSERT_TRUE(talkative);
  std::array<int, 2> stop{};
  ASSERT_EQ(pipe(stop.data()), 0);
  ASSERT_EQ(write(stop[1], "x", 1), 1);
  EXPECT_EQ(talkative->ready_port(10, stop[0]).error().message, "stopped");
  close(stop[0]);
  close(stop[1]);
}

class BuildTreeTest : public testing::Test {
 protected:
  /// A build tree whose one program is made by this command of the shell.
  void make_tree(const std::string& command) {
    std::filesystem::create_directory(bin());
    std::ofstream(folder_ / "CMakeCache.txt") << "CMAKE_PROJECT_NAME:STATIC=measures\nCMAKE_GENERATOR:INTERNAL=Ninja\n"
                                                 "CMAKE_MAKE_PROGRAM:FILEPATH=ninja\n";
    std::ofstream(folder_ / "build.ninja")
        << "rule make\n  command = " << command << "\nbuild bin/measures: make\nbuild measures: phony bin/measures\n";
  }
  [[nodiscard]] std::string bin() const { return folder_ / "bin"; }
  test_support::PrivateFolder folder_;
};

TEST_F(BuildTreeTest, AProgramIsBuilt) {
  make_tree("touch bin/measures");
  const auto built = bring_up_to_date("measures", bin());
  EXPECT_TRUE(built) << built.error().message;
  EXPECT_TRUE(std::filesystem::exists(bin() + "/measures"));
}

TEST_F(BuildTreeTest, SaysWhichBuildFailed) {
  make_tree("false");
  const auto built = bring_up_to_date("measures", bin());
  ASSERT_FALSE(built);
  EXPECT_NE(built.error().message.find("--target measures"), std::string::npos) << built.error().message;
}

TEST_F(BuildTreeTest, OutsideOfOneThereIsNothingToDo) {
  EXPECT_TRUE(bring_up_to_date("measures", bin()));
}

}  // namespace
}  // namespace farfeel::front
