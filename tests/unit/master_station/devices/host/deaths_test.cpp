// The death, or the sleep, of any of the processes between a hand and its force takes the force off.
//
// How soon is farfeel-bench device's to say; what a test asserts holds on any machine: zero comes without anybody's
// help, and force stays off until somebody asks for it anew.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/link/owner_process.h"
#include "tests/support/devices/socket_device.h"
#include "tests/support/private_folder.h"

namespace farfeel::devices {
namespace {

using test_support::SocketDevice;

constexpr int kLong_ms = 30'000;  // that nothing comes
constexpr double kForce_N = 2.5;

OwnerProcess::Options owner_of(const std::string& path) {
  return {FARFEEL_SOCKET_DEVICE_OWNER, {"--firmware", path}};
}

/// Commands a force every millisecond, for the opening that it found once it was told to.
class Station {
 public:
  explicit Station(LinkMemory& memory) : memory_(memory), thread_([this](std::stop_token stop) { run(stop); }) {}
  void grip() { wants_force_ = true; }

 private:
  void run(const std::stop_token& stop) {
    std::uint32_t opening = 0;
    while (!stop.stop_requested()) {
      const std::int64_t now_ns = realtime::monotonic_now_ns();
      Sample sample;
      if (memory_.sample.load(sample) && wants_force_.exchange(false)) opening = sample.opening;
      Command command;
      command.time_ns = now_ns;
      command.opening = opening;
      command.is_force_on = opening != 0;
      command.F_hand_B.force_N.x = kForce_N;
      memory_.command.store(command);
      realtime::wait_until(now_ns + 1'000'000, 0);
    }
  }

  LinkMemory& memory_;
  std::atomic<bool> wants_force_{false};
  std::jthread thread_;
};

class DeathsTest : public testing::Test {
 protected:
  /// Whether a command of that force is taken before long; all others are passed over.
  bool comes(double force_N, int patience_ms = kLong_ms) {
    for (const std::int64_t until_ns = realtime::monotonic_now_ns() + patience_ms * std::int64_t{1'000'000};
         realtime::monotonic_now_ns() < until_ns;) {
      device_.tell(0.01, 0);
      if (const auto taken = device_.take(100); taken && taken->force_N == force_N) return true;
    }
    return false;
  }
  /// Whether the device is ready for force, and takes none yet.
  bool is_ready(const OwnerProcess& owner) {
    for (int i = 0; i < kLong_ms && owner.newest().stage != Stage::kReady; ++i) static_cast<void>(comes(0));
    return comes(0);
  }
  /// Whether a grip brings force. Where a machine stood still for 20 ms, the force is taken off again, which the number
  /// of the opening tells: then, and only then, the person grips anew.
  bool grips(Station& station, const OwnerProcess& owner) {
    for (int waited_ms = 0; waited_ms < kLong_ms;) {
      const std::uint32_t opening = owner.newest().opening;
      station.grip();
      do {
        if (comes(kForce_N, 100)) return true;
        waited_ms += 100;
      } while (waited_ms < kLong_ms && owner.newest().opening == opening);
    }
    return false;
  }
  /// Whether only zero is taken for a while.
  bool stays_zero() {
    for (int i = 0; i < 100; ++i) {
      if (const auto taken = device_.take(2); taken && taken->force_N != 0) return false;
    }
    return true;
  }

  test_support::PrivateFolder folder_;
  SocketDevice device_{folder_ / "socket"};
};

pid_t child_of(pid_t parent) {
  std::ifstream children("/proc/" + std::to_string(parent) + "/task/" + std::to_string(parent) + "/children");
  pid_t child = -1;
  children >> child;
  return child;
}

TEST_F(DeathsTest, TheKeeperTakesForceOffWhenTheOwnerIsKilled) {
  auto owner = OwnerProcess::start(owner_of(device_.path()));
  ASSERT_TRUE(owner) << owner.error();
  ASSERT_TRUE(device_.accept(kLong_ms));
  Station station(owner->memory());
  ASSERT_TRUE(is_ready(*owner));
  ASSERT_NE(child_of(owner->pid()), -1) << "no keeper";
  ASSERT_TRUE(grips(station, *owner));

  ASSERT_EQ(kill(owner->pid(), SIGKILL), 0);
  EXPECT_TRUE(comes(0));
  EXPECT_TRUE(stays_zero());
  EXPECT_GT(owner->memory().taken_off.load(), 0u);

  EXPECT_NE(owner->look(realtime::monotonic_now_ns()).find("killed by signal 9"), std::string::npos);
  // Another owner comes; the station's old wish is not its command.
  const std::uint32_t opening = owner->newest().opening;
  EXPECT_EQ(owner->look(realtime::monotonic_now_ns() + OwnerProcess::kAgain_ns), "");
  ASSERT_TRUE(device_.accept(kLong_ms));
  ASSERT_TRUE(is_ready(*owner));
  EXPECT_TRUE(stays_zero());
  EXPECT_GT(owner->newest().opening, opening);
  EXPECT_TRUE(grips(station, *owner));
}

TEST_F(DeathsTest, TheKeeperTakesForceOffWhenTheOwnerHangs) {
  auto owner = OwnerProcess::start(owner_of(device_.path()));
  ASSERT_TRUE(owner) << owner.error();
  ASSERT_TRUE(device_.accept(kLong_ms));
  Station station(owner->memory());
  ASSERT_TRUE(is_ready(*owner));
  ASSERT_TRUE(grips(station, *owner));
  const std::uint32_t opening = owner->newest().opening;

  ASSERT_EQ(kill(owner->pid(), SIGSTOP), 0);
  EXPECT_TRUE(comes(0));
  EXPECT_TRUE(stays_zero());
  ASSERT_EQ(kill(owner->pid(), SIGCONT), 0);
  EXPECT_TRUE(comes(0));
  EXPECT_TRUE(stays_zero()) << "it goes on with the force that was taken off";
  EXPECT_GT(owner->newest().opening, opening);
  EXPECT_TRUE(grips(station, *owner));
}

TEST_F(DeathsTest, TheOwnerTakesForceOffWhenItsKeeperIsKilledAndGetsAnother) {
  auto owner = OwnerProcess::start(owner_of(device_.path()));
  ASSERT_TRUE(owner) << owner.error();
  ASSERT_TRUE(device_.accept(kLong_ms));
  Station station(owner->memory());
  ASSERT_TRUE(is_ready(*owner));
  ASSERT_TRUE(grips(station, *owner));
  const pid_t keeper = child_of(owner->pid());
  ASSERT_GT(keeper, 0);

  ASSERT_EQ(kill(keeper, SIGKILL), 0);
  EXPECT_TRUE(comes(0));
  EXPECT_TRUE(stays_zero());
  EXPECT_NE(child_of(owner->pid()), keeper);
  EXPECT_GT(child_of(owner->pid()), 0);
  EXPECT_TRUE(grips(station, *owner));
}

TEST_F(DeathsTest, TheOwnerTakesForceOffAndEndsWhenTheStationIsKilled) {
  int told[2];
  ASSERT_EQ(pipe(told), 0);
  const pid_t station = fork();
  if (station == 0) {
    auto owner = OwnerProcess::start(owner_of(device_.path()));
    const pid_t pid = owner ? owner->pid() : -1;
    static_cast<void>(write(told[1], &pid, sizeof pid));
    if (!owner) _exit(1);
    Station commands(owner->memory());
    for (;;) {
      if (owner->newest().stage == Stage::kReady) commands.grip();
      usleep(1000);
    }
  }
  pid_t owner = -1;
  ASSERT_EQ(read(told[0], &owner, sizeof owner), static_cast<ssize_t>(sizeof owner));
  ASSERT_GT(owner, 0);
  ASSERT_TRUE(device_.accept(kLong_ms));
  ASSERT_TRUE(comes(kForce_N));
  ASSERT_EQ(kill(station, SIGKILL), 0);
  ASSERT_EQ(waitpid(station, nullptr, 0), station);
  EXPECT_TRUE(comes(0));
  EXPECT_TRUE(stays_zero());
  bool has_ended = false;
  for (int i = 0; i < kLong_ms / 10 && !has_ended; ++i) {
    has_ended = kill(owner, 0) != 0;
    usleep(10'000);
  }
  EXPECT_TRUE(has_ended) << "the owner outlives its station";
}

TEST_F(DeathsTest, AStationThatFallsSilentIsNotObeyed) {
  auto owner = OwnerProcess::start(owner_of(device_.path()));
  ASSERT_TRUE(owner) << owner.error();
  ASSERT_TRUE(device_.accept(kLong_ms));
  {
    Station station(owner->memory());
    ASSERT_TRUE(is_ready(*owner));
    ASSERT_TRUE(grips(station, *owner));
  }
  EXPECT_TRUE(comes(0));
  EXPECT_TRUE(stays_zero());
}

TEST_F(DeathsTest, PluggedInAgainItIsReadyWithoutARestartAndForceWaitsForAGrip) {
  auto owner = OwnerProcess::start(owner_of(device_.path()));
  ASSERT_TRUE(owner) << owner.error();
  ASSERT_TRUE(device_.accept(kLong_ms));
  Station station(owner->memory());
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(is_ready(*owner));
    EXPECT_EQ(owner->opened().model.text(), "socket-device");
    EXPECT_TRUE(owner->opened().has_keeper);
    EXPECT_TRUE(stays_zero());
    ASSERT_TRUE(grips(station, *owner));
    device_.unplug();
    ASSERT_TRUE(device_.accept(kLong_ms));
  }
}

TEST_F(DeathsTest, AMemoryOfAnotherBuildIsRefused) {
  const int fd = static_cast<int>(memfd_create("other", 0));
  ASSERT_EQ(ftruncate(fd, sizeof(LinkMemory)), 0);
  const auto link = MappedLink::open(fd);
  ASSERT_FALSE(link);
  EXPECT_NE(link.error().find("another version"), std::string::npos);
}

}  // namespace
}  // namespace farfeel::devices
