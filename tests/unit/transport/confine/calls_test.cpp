#include "transport/confine/calls.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <semaphore>
#include <thread>

#include "tests/support/in_child.h"

namespace farfeel::transport {
namespace {

using test_support::in_child;
using test_support::Outcome;

/// What comes of the work in a process confined to these calls: its words, or "signal N".
std::string confined(Calls calls, const std::function<std::string()>& work) {
  const Outcome outcome = in_child([&] {
    if (const auto done = restrict_calls(calls); !done) return "no filter: " + done.error();
    return work();
  });
  if (outcome.signal() != 0) return fmt::format("signal {}", outcome.signal());
  return outcome.words;
}
const std::string kKilled = fmt::format("signal {}", SIGSYS);

/// "ok", or the error's name.
std::string told(long result) {
  return result >= 0 ? "ok" : std::string(strerrorname_np(errno));
}
std::string raw(Calls calls, long number, long a = 0, long b = 0, long c = 0, long d = 0) {
  return confined(calls, [=] { return told(syscall(number, a, b, c, d)); });
}
long address_of(const char* text) {
  return reinterpret_cast<long>(text);
}

class CallsTest : public testing::Test {
 protected:
  void SetUp() override {
#ifdef FARFEEL_SANITIZED
    GTEST_SKIP() << "sanitizers make calls of their own: this build has no filter but one against taking over";
#endif
    const std::string why = confined(Calls::kServer, [] { return std::string("there"); });
    if (why != "there") GTEST_SKIP() << why;
  }
};

TEST_F(CallsTest, ThatTakeOverAMachineEndAServer) {
  EXPECT_EQ(raw(Calls::kServer, SYS_execve, address_of("/bin/true")), kKilled);
  EXPECT_EQ(raw(Calls::kServer, SYS_execveat, AT_FDCWD, address_of("/bin/true")), kKilled);
  EXPECT_EQ(raw(Calls::kServer, SYS_ptrace, PTRACE_TRACEME), kKilled);
  EXPECT_EQ(raw(Calls::kServer, SYS_process_vm_writev, 1), kKilled);
  EXPECT_EQ(raw(Calls::kServer, SYS_mount), kKilled);
  EXPECT_EQ(raw(Calls::kServer, SYS_unshare, CLONE_NEWUSER), kKilled);
  EXPECT_EQ(raw(Calls::kServer, SYS_io_uring_setup, 8), kKilled);
  EXPECT_EQ(raw(Calls::kServer, SYS_bpf), kKilled);
  EXPECT_EQ(raw(Calls::kServer, SYS_setuid, 0), kKilled);
  EXPECT_EQ(raw(Calls::kServer, SYS_perf_event_open), kKilled);
}

TEST_F(CallsTest, ThatAServerDoesNotMakeAreNotThere) {
  EXPECT_EQ(raw(Calls::kServer, SYS_fork), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, SYS_clone, SIGCHLD), "ENOSYS") << "a process, not a thread";
  EXPECT_EQ(raw(Calls::kServer, SYS_clone3), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, SYS_kill, 1, 0), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, SYS_tgkill, 1, 1, 0), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, SYS_unlink, address_of("/tmp/nothing")), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, SYS_rename, address_of("/tmp/a"), address_of("/tmp/b")), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, SYS_creat, address_of("/tmp/nothing")), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, SYS_openat2, AT_FDCWD, address_of("/dev/null")), "ENOSYS") << "flags out of sight";
  EXPECT_EQ(raw(Calls::kServer, SYS_ioctl, 0, 0x5412), "ENOSYS") << "TIOCSTI: types into a terminal";
  EXPECT_EQ(raw(Calls::kServer, SYS_prctl, 4L /* PR_SET_DUMPABLE */), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, 100'000), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, SYS_socket, AF_INET, SOCK_STREAM), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, SYS_socket, AF_INET, SOCK_RAW), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, SYS_socket, AF_UNIX, SOCK_DGRAM), "ENOSYS");
  EXPECT_EQ(raw(Calls::kServer, SYS_socket, AF_NETLINK, SOCK_DGRAM), "ENOSYS");
}

TEST_F(CallsTest, OpenFilesToReadAlone) {
  const auto opened = [](int flags) {
    return confined(Calls::kServer, [flags] { return told(::open("/dev/null", flags | O_CLOEXEC, 0600)); });
  };
  EXPECT_EQ(opened(O_RDONLY), "ok");
  EXPECT_EQ(opened(O_RDONLY | O_NONBLOCK | O_NOFOLLOW), "ok");
  EXPECT_EQ(opened(O_WRONLY), "EACCES");
  EXPECT_EQ(opened(O_RDWR), "EACCES");
  EXPECT_EQ(opened(O_RDWR | O_CREAT), "EACCES");
  EXPECT_NE(opened(O_RDONLY | O_TRUNC), "ok");
  EXPECT_NE(opened(O_RDONLY | O_CREAT), "ok");
  EXPECT_NE(opened(O_ACCMODE), "ok");
}

TEST_F(CallsTest, RunNoCodeThatCameAsData) {
  EXPECT_EQ(confined(Calls::kServer,
                     [] {
                       void* page = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
                       return page == MAP_FAILED ? "no page" : told(::mprotect(page, 4096, PROT_READ | PROT_EXEC));
                     }),
            "ENOSYS");
  EXPECT_EQ(confined(Calls::kServer,
                     [] {
                       void* page = ::mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
                       return told(page == MAP_FAILED ? -1 : 0);
                     }),
            "ENOSYS");
}

TEST_F(CallsTest, LetAServerServe) {
  EXPECT_EQ(confined(Calls::kServer,
                     [] {
                       const int a = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0),
                                 b = ::socket(AF_INET, SOCK_DGRAM, 0);
                       if (a < 0 || b < 0) return told(-1);
                       sockaddr_in at{};
                       at.sin_family = AF_INET;
                       at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
                       socklen_t size = sizeof at;
                       auto* const to = reinterpret_cast<sockaddr*>(&at);
                       const int on = 1;
                       if (::setsockopt(a, SOL_SOCKET, SO_REUSEPORT, &on, sizeof on) != 0) return told(-1);
                       if (::bind(a, to, size) != 0 || ::getsockname(a, to, &size) != 0) return told(-1);
                       if (::connect(b, to, size) != 0 || ::send(b, "x", 1, 0) != 1) return told(-1);
                       char got = 0;
                       return ::recv(a, &got, 1, 0) == 1 && got == 'x' ? std::string("ok") : told(-1);
                     }),
            "ok");
  EXPECT_EQ(raw(Calls::kServer, SYS_socket, AF_INET6, SOCK_DGRAM | SOCK_NONBLOCK), "ok");
  EXPECT_EQ(confined(Calls::kServer,
                     [] {
                       std::vector<std::vector<char>> memory;
                       for (int i = 0; i < 100; ++i) memory.emplace_back(1 << (i % 24), 'x');
                       memory.clear();
                       std::atomic<int> sum{0};
                       {
                         std::jthread one([&] { sum += 1; }), two([&] { sum += 2; });
                       }
                       return std::to_string(sum);
                     }),
            "3");
  EXPECT_EQ(confined(Calls::kServer,
                     [] {
                       std::abort();
                       return std::string();
                     }),
            fmt::format("signal {}", SIGABRT));
}

TEST_F(CallsTest, HoldForThreadsThatWereThereBefore) {
  const Outcome outcome = in_child([] {
    std::binary_semaphore go{0};
    std::string told_there;
    std::thread earlier([&] {
      go.acquire();
      told_there = told(syscall(SYS_fork));
    });
    if (const auto done = restrict_calls(Calls::kServer); !done) _exit(1);
    go.release();
    earlier.join();
    return told_there;
  });
  EXPECT_EQ(outcome.words, "ENOSYS");
}

TEST_F(CallsTest, BesideADriverAreRefusedWhereTheyTakeOver) {
  constexpr Calls kCalls = Calls::kServerWithDriver;
  EXPECT_EQ(raw(kCalls, SYS_execve, address_of("/bin/true")), "EPERM");
  EXPECT_EQ(raw(kCalls, SYS_ptrace, PTRACE_TRACEME), "EPERM");
  EXPECT_EQ(raw(kCalls, SYS_unshare, CLONE_NEWUSER), "EPERM");
  EXPECT_EQ(confined(kCalls, [] { return told(::open("/dev/null", O_RDWR)); }), "ok");
}

TEST_F(CallsTest, OfAnAnswererAreReadAndWrite) {
  constexpr Calls kCalls = Calls::kAnswerer;
  EXPECT_EQ(raw(kCalls, SYS_openat, AT_FDCWD, address_of("/dev/null")), kKilled);
  EXPECT_EQ(raw(kCalls, SYS_socket, AF_INET, SOCK_DGRAM), kKilled);
  EXPECT_EQ(raw(kCalls, SYS_write, STDERR_FILENO, address_of("x"), 1), kKilled);
  EXPECT_EQ(raw(kCalls, SYS_fork), kKilled);
  // It cannot tell by the pipe of this test: its end does.
  const Outcome outcome = in_child([] {
    if (!restrict_calls(kCalls)) _exit(1);
    std::vector<char> memory(100'000'000, 'x');
    _exit(::write(STDOUT_FILENO, memory.data(), 0) == 0 ? 7 : 8);
    return std::string();
  });
  EXPECT_EQ(WEXITSTATUS(outcome.status), 7);
}

TEST(Calls, OfEveryBuildStartNoProgramBesideADriver) {
  const std::string said =
      confined(Calls::kServerWithDriver, [] { return told(::execl("/bin/true", "true", nullptr)); });
  if (said.starts_with("no filter")) GTEST_SKIP() << said;
  EXPECT_EQ(said, "EPERM");
}

}  // namespace
}  // namespace farfeel::transport
