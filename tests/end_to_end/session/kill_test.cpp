// kill -9 of either end in the middle of a session, as a process of its own, and what the other end makes of it.

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/end_to_end/session/both_ends.h"

namespace farfeel::end_to_end {
namespace {

/// A child process that runs one end until it is killed. Fork before this process has threads of its own.
class Child {
 public:
  template <typename Life>
  explicit Child(Life life) {
    int ends[2];
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    pid_ = fork();
    if (pid_ == 0) {
      life([&](std::uint16_t word) { (void)!write(ends[1], &word, sizeof word); });
      _exit(0);
    }
    ::close(ends[1]);
    from_child_ = ends[0];
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    kill9();
    ::close(from_child_);
  }
  /// What the child says next; waits for it.
  std::uint16_t hear() const {
    std::uint16_t word = 0;
    if (read(from_child_, &word, sizeof word) != sizeof word) throw std::runtime_error("the child is gone");
    return word;
  }
  void kill9() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }

 private:
  pid_t pid_ = -1;
  int from_child_ = -1;
};

TEST(Kill9, OfTheSlaveIsNoticedAndItsRestartIsFeltAgain) {
  const auto serve = [](std::uint16_t port, const auto& say) {
    Floor floor;
    const auto remote = slave(floor, transport::loopback().with_port(port));
    say(remote->local().port);
    for (;;) pause();
  };
  Child first([&](const auto& say) { serve(0, say); });
  const std::uint16_t port = first.hear();
  // The second slave waits to be told of, so that it forks before the master starts threads here.
  int go[2];
  ASSERT_EQ(pipe(go), 0);
  Child restarted([&](const auto& say) {
    char word = 0;
    (void)!read(go[0], &word, 1);
    serve(port, say);
  });
  const auto session = master(transport::loopback().with_port(port));
  std::uint32_t sequence = 0;
  ASSERT_TRUE(feels(*session, sequence));
  first.kill9();
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (session->state() == MasterSession::State::kConnected && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(session->state(), MasterSession::State::kLost);
  EXPECT_NE(session->trouble(), "");
  ASSERT_EQ(write(go[1], "g", 1), 1);
  EXPECT_EQ(restarted.hear(), port);
  EXPECT_TRUE(feels(*session, sequence));
  EXPECT_EQ(session->report().sessions, 2u);
  ::close(go[0]);
  ::close(go[1]);
}

TEST(Kill9, OfTheMasterFreesTheSlaveForTheNext) {
  int port_pipe[2];
  ASSERT_EQ(pipe(port_pipe), 0);
  Child operator_process([&](const auto& say) {
    std::uint16_t port = 0;
    (void)!read(port_pipe[0], &port, sizeof port);
    const auto session = master(transport::loopback().with_port(port));
    std::uint32_t sequence = 0;
    say(feels(*session, sequence) ? 1 : 0);
    for (;;) (void)feels(*session, sequence);
  });
  Floor floor;
  const auto remote = slave(floor, transport::loopback());
  const std::uint16_t port = remote->local().port;
  ASSERT_EQ(write(port_pipe[1], &port, sizeof port), static_cast<ssize_t>(sizeof port));
  EXPECT_EQ(operator_process.hear(), 1);
  operator_process.kill9();
  const auto session = master(remote->local());  // refused while the old session lives, then welcomed
  std::uint32_t sequence = 0;
  EXPECT_TRUE(feels(*session, sequence));
  EXPECT_EQ(floor.restarts.load(), 2);  // the first session, and the second in its place
  ::close(port_pipe[0]);
  ::close(port_pipe[1]);
}

}  // namespace
}  // namespace farfeel::end_to_end
