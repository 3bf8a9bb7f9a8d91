// farfeel-relay as a person starts it, between two ends that use what a lane uses: a listening port, a connected socket
// and the relay's client before it.
//
// The firewall that makes a relay necessary is played by the ends: while it stands, each drops what comes from the
// other.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/private_folder.h"
#include "transport/net/listening_port.h"
#include "transport/relay/relay_client.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kMs = 1'000'000, kSecond = 1000 * kMs;

struct Program {
  pid_t pid = -1;
  int out = -1, ready = -1;

  static Program start(std::vector<std::string> arguments) {
    int out[2], ready[2];
    if (pipe(out) != 0 || pipe(ready) != 0) return {};
    arguments.insert(arguments.begin(), FARFEEL_PROGRAMS "/farfeel-relay");
    Program program;
    program.pid = fork();
    if (program.pid == 0) {
      dup2(out[1], 1);
      dup2(ready[1], 3);
      std::vector<char*> argv;
      for (std::string& argument : arguments) argv.push_back(argument.data());
      argv.push_back(nullptr);
      execv(argv[0], argv.data());
      _exit(127);
    }
    close(out[1]);
    close(ready[1]);
    program.out = out[0];
    program.ready = ready[0];
    return program;
  }
  static std::string read_all(int descriptor) {
    std::string text;
    char buffer[512];
    ssize_t size = 0;
    while ((size = read(descriptor, buffer, sizeof buffer)) > 0) text.append(buffer, static_cast<std::size_t>(size));
    close(descriptor);
    return text;
  }
  /// What it printed, once it ended well.
  std::string finish() {
    const std::string text = read_all(out);
    int status = 0;
    EXPECT_EQ(waitpid(pid, &status, 0), pid);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
    close(ready);
    return text;
  }
};

class End {
 public:
  End(const Address& relay, const RelayToken& token, RelayRole role)
      : client_({relay, token, "lab", role, 0, 1, random_key()}, monotonic_ns()),
        port_(ListeningPort::open(any_address(relay.is_ipv6), {}).value()),
        lane_(port_.make_lane(Dscp::kExpedited).value()),
        role_(role) {}

  /// A master's lane goes to path(); a slave's to where what it can open comes from, as all lanes do.
  void run(std::int64_t now) {
    while (const auto out = client_.next(now)) port_.send_to(out->to, out->bytes);
    while (const auto received = port_.receive(buffer_)) {
      if (firewall_stands && received->from != relay()) continue;
      if (!client_.receive(received->from, received->bytes, now)) port_.pass_on(lane_.number(), *received);
    }
    while (const auto received = lane_.receive(buffer_)) {
      if (relay_type(received->bytes)) {
        lane_.give_back(*received);
        continue;
      }
      if (firewall_stands && received->from != relay()) continue;
      ++heard;
      last_from = received->from;
      last_dscp = received->dscp;
      if (role_ == RelayRole::kSlave && lane_.peer() != received->from) {
        ASSERT_TRUE(lane_.connect_to(received->from, received->to));
      }
    }
    if (role_ == RelayRole::kMaster && lane_.peer() != client_.path()) {
      ASSERT_TRUE(lane_.connect_to(client_.path(), any_address(client_.path().is_ipv6)));
    }
    const std::array<std::byte, 116> pose{std::byte{4}};
    sent += lane_.send(pose);
  }
  RelayClient::State state() const { return client_.state(monotonic_ns()); }
  Address relay() const { return relay_; }
  std::optional<Error> trouble() const { return client_.trouble(monotonic_ns()); }

  bool firewall_stands = true;
  std::size_t sent = 0, heard = 0;
  Address last_from;
  int last_dscp = -1;
  Address relay_;

 private:
  RelayClient client_;
  ListeningPort port_;
  LaneSocket lane_;
  RelayRole role_;
  std::array<std::byte, kMostDatagramBytes> buffer_;
};

class RelayProgram : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (GetParam() && !UdpSocket::open(loopback(true))) GTEST_SKIP() << "this machine has no IPv6";
  }
  test_support::PrivateFolder private_folder_;
  const std::string folder_ = private_folder_.path();
};
INSTANTIATE_TEST_SUITE_P(Over, RelayProgram, testing::Bool(),
                         [](const auto& which) { return which.param ? "IPv6" : "IPv4"; });

TEST_P(RelayProgram, ForwardsUntilTheWayIsDirect) {
  const std::string key = folder_ + "/relay.key";
  auto printer = Program::start({"--key", key, "token", "--days", "1"});
  close(printer.ready);
  printer.ready = -1;
  const std::string text = printer.finish();
  const auto token = parse_token(text);
  ASSERT_TRUE(token) << text;

  auto program = Program::start({"--key", key, "serve", "--listen", GetParam() ? "[::1]:0" : "127.0.0.1:0",
                                 "--ready-fd", "3", "--seconds", "60"});
  char ready[32] = "";
  ASSERT_GT(read(program.ready, ready, sizeof ready - 1), 6);
  const Address relay = loopback(GetParam()).with_port(static_cast<std::uint16_t>(std::atoi(ready + 6)));

  End master(relay, *token, RelayRole::kMaster), slave(relay, *token, RelayRole::kSlave);
  master.relay_ = slave.relay_ = relay;
  const auto run_until = [&](const auto& is_done) {
    const std::int64_t end = monotonic_ns() + 20 * kSecond;
    while (!is_done() && monotonic_ns() < end) {
      master.run(monotonic_ns());
      slave.run(monotonic_ns());
      usleep(500);
    }
    return is_done();
  };
  EXPECT_TRUE(run_until([&] { return master.heard > 200 && slave.heard > 200; }));
  EXPECT_EQ(master.state(), RelayClient::State::kRelayed);
  EXPECT_EQ(slave.last_from, relay);
  EXPECT_EQ(slave.last_dscp, 46) << "the marking is forwarded as well";

  master.firewall_stands = slave.firewall_stands = false;
  EXPECT_TRUE(run_until([&] {
    return master.state() == RelayClient::State::kDirect && slave.state() == RelayClient::State::kDirect &&
           master.last_from != relay && slave.last_from != relay;
  }));
  const std::size_t sent = master.sent, heard = slave.heard;
  EXPECT_TRUE(run_until([&] { return master.sent >= sent + 200; }));
  EXPECT_GE(slave.heard - heard + 2, 200u);
  EXPECT_EQ(master.trouble(), std::nullopt);

  kill(program.pid, SIGTERM);
  const std::string counts = program.finish();
  EXPECT_NE(counts.find("\"ends\":2"), std::string::npos) << counts;
  EXPECT_EQ(counts.find("\"forwarded\":0,"), std::string::npos) << counts;
}

TEST_P(RelayProgram, SaysWhatIsWrong) {
  const std::string key = folder_ + "/relay.key";
  auto printer = Program::start({"--key", key, "token"});
  (void)printer.finish();
  ASSERT_EQ(chmod(key.c_str(), 0644), 0);
  auto program = Program::start({"--key", key, "serve", "--listen", "127.0.0.1:0", "--seconds", "1"});
  int status = 0;
  ASSERT_EQ(waitpid(program.pid, &status, 0), program.pid);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 2) << "others can read the key";
  close(program.out);
  close(program.ready);
}

}  // namespace
}  // namespace farfeel::transport
