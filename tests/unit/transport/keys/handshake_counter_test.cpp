#include "transport/keys/handshake_counter.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "tests/unit/transport/keys/small_files.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kNow_ns = 1'800'000'000 * kSecond_ns;
constexpr std::uint64_t kBoot = 11, kNextBoot = 12;

struct HandshakeCounterTest : testing::Test {
  HandshakeCounter open(std::uint64_t boot = kBoot) {
    auto counter = HandshakeCounter::open(path, boot);
    EXPECT_TRUE(counter) << counter.error().message;
    return std::move(*counter);
  }
  std::uint64_t word(std::size_t i) {
    std::uint64_t value = 0;
    std::memcpy(&value, got(path).data() + 8 * i, 8);
    return value;
  }
  std::uint64_t ceiling_on_disk() { return word(4); }

  PrivateFolder folder;
  std::string path = folder / "counter";
};

TEST_F(HandshakeCounterTest, FollowsTheClockAndNeverGoesBack) {
  HandshakeCounter counter = open();
  EXPECT_EQ(counter.next(kNow_ns), static_cast<std::uint64_t>(kNow_ns));
  EXPECT_EQ(counter.next(kNow_ns), static_cast<std::uint64_t>(kNow_ns) + 1);
  EXPECT_EQ(counter.next(kNow_ns + kSecond_ns), static_cast<std::uint64_t>(kNow_ns + kSecond_ns));
  std::uint64_t last = counter.next(kNow_ns);
  EXPECT_EQ(last, static_cast<std::uint64_t>(kNow_ns + kSecond_ns) + 1);
  for (const std::int64_t clock : {kNow_ns - 300 * kSecond_ns, std::int64_t{0}, std::int64_t{-1},
                                   std::numeric_limits<std::int64_t>::min(), kNow_ns + 2 * kSecond_ns, kNow_ns}) {
    const std::uint64_t next = counter.next(clock);
    EXPECT_GT(next, last);
    last = next;
  }
}

TEST_F(HandshakeCounterTest, GoesOnAfterARestartWithTheClockSetBack) {
  std::uint64_t last = 0;
  for (int restart = 0; restart < 5; ++restart) {
    HandshakeCounter counter = open();
    for (int i = 0; i < 3; ++i) {
      const std::uint64_t next = counter.next(kNow_ns - restart * 300 * kSecond_ns);
      EXPECT_GT(next, last);
      last = next;
    }
  }
  EXPECT_LT(last, static_cast<std::uint64_t>(kNow_ns + kSecond_ns)) << "and does not run ahead of the clock for it";
}

TEST_F(HandshakeCounterTest, GoesOnAfterAKill) {
  std::uint64_t last = 0;
  for (int round = 0; round < 3; ++round) {
    std::array<int, 2> ends{};
    ASSERT_EQ(pipe(ends.data()), 0);
    const pid_t child = fork();
    if (child == 0) {
      HandshakeCounter counter = open();
      for (int i = 0;; ++i) {
        const std::uint64_t next = counter.next(kNow_ns - round * 300 * kSecond_ns + i);
        if (write(ends[1], &next, sizeof next) != sizeof next) _exit(1);
      }
    }
    close(ends[1]);
    std::uint64_t next = 0;
    for (int i = 0; i < 100 && read(ends[0], &next, sizeof next) == sizeof next; ++i) {
      EXPECT_GT(next, last);
      last = next;
    }
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    while (read(ends[0], &next, sizeof next) == sizeof next) last = next;
    close(ends[0]);
  }
  EXPECT_GT(open().next(0), last);
}

// A power cut: what was not synced is lost. The file is put back to what it held when the ceiling was raised last.
TEST_F(HandshakeCounterTest, GoesOnAfterAPowerCutWithTheClockSetBack) {
  std::uint64_t last = 0;
  std::string on_disk;
  {
    HandshakeCounter counter = open();
    std::uint64_t ceiling = 0;
    for (int s = 0; s < 200; ++s) {
      const std::int64_t clock = kNow_ns + s * kSecond_ns;
      if (s % 3 == 0) {
        EXPECT_TRUE(counter.keep_ahead(clock));
      }
      last = counter.next(clock);
      EXPECT_LE(last, ceiling_on_disk()) << "no number is given that the disk does not allow for";
      if (ceiling_on_disk() != ceiling) {
        ceiling = ceiling_on_disk();
        on_disk = got(path);
        const std::uint64_t older = static_cast<std::uint64_t>(kNow_ns) + 1;
        std::memcpy(on_disk.data() + 16, &older, 8);
      }
    }
  }
  put(path, on_disk);
  HandshakeCounter counter = open(kNextBoot);
  EXPECT_GT(counter.next(kNow_ns - 300 * kSecond_ns), last);
}

TEST_F(HandshakeCounterTest, AnUnknownStartOfTheMachineIsTakenForANewOne) {
  std::uint64_t last = open(0).next(kNow_ns);
  for (int i = 0; i < 3; ++i) {
    const std::uint64_t next = open(0).next(kNow_ns - 300 * kSecond_ns);
    EXPECT_GT(next, last);
    last = next;
  }
}

TEST_F(HandshakeCounterTest, WritesOnceAMinuteAtMost) {
  HandshakeCounter counter = open();
  std::set<std::uint64_t> ceilings;
  constexpr int kSeconds = 3600;
  for (int tenth = 0; tenth < kSeconds * 10; ++tenth) {
    const std::int64_t clock = kNow_ns + tenth * kSecond_ns / 10;
    EXPECT_TRUE(counter.keep_ahead(clock));
    (void)counter.next(clock);
    ceilings.insert(ceiling_on_disk());
  }
  EXPECT_LE(ceilings.size(), std::size_t{kSeconds / 60 + 1});
}

TEST_F(HandshakeCounterTest, GivesEachNumberOnceToThreadsOfManyHandles) {
  constexpr int kThreads = 4, kEach = 20'000;
  std::array<std::vector<std::uint64_t>, kThreads> given;
  HandshakeCounter shared = open();
  {
    std::vector<std::jthread> threads;
    for (auto& mine : given)
      threads.emplace_back([&mine, &shared, this] {
        HandshakeCounter own = open();
        for (int i = 0; i < kEach; ++i) mine.push_back((i % 2 == 0 ? own : shared).next(kNow_ns + i % 100));
      });
  }
  std::set<std::uint64_t> all;
  for (const auto& mine : given) {
    EXPECT_TRUE(std::is_sorted(mine.begin(), mine.end()));
    all.insert(mine.begin(), mine.end());
  }
  EXPECT_EQ(all.size(), std::size_t{kThreads * kEach});
}

TEST_F(HandshakeCounterTest, KeepsOneOrderOverAForkAndBesideAnotherProgram) {
  HandshakeCounter counter = open();
  (void)counter.next(kNow_ns);
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  constexpr int kPrograms = 3, kEach = 2000;
  for (int p = 0; p < kPrograms; ++p) {
    if (fork() == 0) {
      // The first goes on with what it was born with, the others open the file themselves. Clocks of 300 s apart.
      std::optional<HandshakeCounter> own;
      if (p > 0) own.emplace(open());
      for (int i = 0; i < kEach; ++i) {
        const std::uint64_t next = (own ? *own : counter).next(kNow_ns - 300 * kSecond_ns * p + i);
        if (write(ends[1], &next, sizeof next) != sizeof next) _exit(1);
      }
      _exit(0);
    }
  }
  std::set<std::uint64_t> all;
  for (int i = 0; i < kPrograms * kEach; ++i) {
    std::uint64_t next = 0;
    ASSERT_EQ(read(ends[0], &next, sizeof next), static_cast<ssize_t>(sizeof next));
    all.insert(next);
  }
  for (int p = 0; p < kPrograms; ++p) wait(nullptr);
  EXPECT_EQ(all.size(), std::size_t{kPrograms * kEach});
  EXPECT_GT(counter.next(0), *all.rbegin());
  close(ends[0]);
  close(ends[1]);
}

TEST_F(HandshakeCounterTest, IsTheOwnersAloneAndRefusesAFileThatIsBroken) {
  (void)open().next(kNow_ns);
  EXPECT_EQ(mode_of(path), 0600);
  EXPECT_EQ(got(path).size(), 64u);
  const std::string good = got(path);
  for (const std::string& bad : {std::string(), good.substr(1), good + "x", "x" + good.substr(1),
                                 good.substr(0, 16) + std::string(8, '\xff') + good.substr(24),
                                 good.substr(0, 24) + std::string(8, '\xff') + good.substr(32)}) {
    put(path, bad);
    const auto refused = HandshakeCounter::open(path, kBoot);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, KeysErrorKind::kMalformed);
    EXPECT_NE(refused.error().message.find("rm '" + path + "'"), std::string::npos);
  }
  put(path, good);
  chmod(path.c_str(), 0660);
  EXPECT_EQ(HandshakeCounter::open(path, kBoot).error().kind, KeysErrorKind::kPermissions);
}

TEST_F(HandshakeCounterTest, KnowsThisMachinesStart) {
  (void)HandshakeCounter::open(path)->next(kNow_ns);
  EXPECT_NE(word(1), 0u) << "Linux says what start this is";
  const std::uint64_t last = HandshakeCounter::open(path)->next(0);
  EXPECT_EQ(last, static_cast<std::uint64_t>(kNow_ns) + 1);
}

}  // namespace
}  // namespace farfeel::transport
