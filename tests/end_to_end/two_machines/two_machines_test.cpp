// docs/two-machines.md with the real programs: a slave, an operator and a relay in network namespaces of their own, 50
// ms and NATs between them, names, keys of their own, and nothing shared.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include "deploy/front/child.h"
#include "tests/support/private_folder.h"
#include "tests/support/simulated_internet.h"
#include "tests/support/wait_for_progress.h"

namespace farfeel::end_to_end {
namespace {

using front::Child;
using front::Progress;
using transport::Looks;
using transport::NatKind;

constexpr auto kPatience = std::chrono::seconds(240);  // a first bake included; not a measurement
constexpr std::int64_t kMs = 1'000'000;
enum Machine : std::size_t { kOperator, kSlave, kRelay, kMachines };

// One outer port for all remotes, which lets in whom it sent to; and one for each remote, past which no way leads.
constexpr NatKind kCommonNat{Looks::kNowhere, Looks::kAtHostAndPort};
constexpr NatKind kSymmetricNat{Looks::kAtHostAndPort, Looks::kAtHostAndPort};

/// Names for this process and those that it starts: a mount namespace of this thread's own with another /etc/hosts.
bool give_names() {
  static const test_support::PrivateFolder folder;
  const std::string path = folder / "hosts";
  std::ofstream(path) << "10.7.0.2 lab.example.org\n198.51.100.1 relay.example.org\n";
  return unshare(CLONE_NEWNS) == 0 && mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         mount(path.c_str(), "/etc/hosts", nullptr, MS_BIND, nullptr) == 0;
}

class TwoMachines : public testing::Test {
 protected:
  /// Empty, or the reason to skip by.
  std::string lay(std::int64_t one_way_ns) {
    auto made = SimulatedInternet::make(kMachines, one_way_ns);
    if (!made) return made.error();
    net_ = *std::move(made);
    static const bool has_names = give_names();
    return has_names ? "" : "may not make a mount namespace, for names";
  }
  void know_each_other() {
    const std::string slaves_lines = key_command(kSlave, {"new", "--name", "lab"});
    const std::string operators_lines = key_command(kOperator, {"new", "--name", "anna"});
    paste(slaves_lines, "slave", kOperator);
    paste(operators_lines, "operator", kSlave);
  }

  Child start(Machine where, const std::string& name, std::vector<std::string> arguments, bool has_ready = false) {
    std::optional<Child> child;
    const std::string log = fmt::format("{}/{}-{}.log", folder_, name, ++programs_);
    net_->in(where, [&] {
      auto started = Child::start(std::string(FARFEEL_PROGRAMS) + "/" + name, std::move(arguments), log,
                                  Child::Output::kIsRead, has_ready);
      if (!started) throw std::runtime_error(started.error().message);
      child.emplace(std::move(*started));
    });
    return std::move(*child);
  }
  /// Its exit status, and all that it said.
  static std::pair<int, std::string> said_to_the_end(Child& child) {
    std::string text;
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < end) {
      char bytes[4096];
      const ssize_t got = read(child.output_fd(), bytes, sizeof bytes);
      if (got <= 0) break;
      text.append(bytes, static_cast<std::size_t>(got));
    }
    while (!child.status() && std::chrono::steady_clock::now() < end) poll(nullptr, 0, 10);
    return {child.status().value_or(-1), text};
  }
  std::string keys(Machine where) const { return folder_ + (where == kOperator ? "/operator" : "/slave"); }
  std::string key_command(Machine where, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "key");
    arguments.insert(arguments.end(), {"--folder", keys(where)});
    Child child = start(where, "farfeel", arguments);
    const auto [status, said] = said_to_the_end(child);
    EXPECT_EQ(status, 0) << child.obituary();
    return said;
  }
  /// The line that a person would copy, run at the other machine.
  void paste(const std::string& shown, const std::string& role, Machine where) {
    std::istringstream lines(shown);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string program, key, trust, of, name, value;
      if (words >> program >> key >> trust >> of >> name >> value && program == "farfeel" && trust == "trust" &&
          of == role)
        return (void)key_command(where, {trust, of, name, value});
    }
    FAIL() << "no line to trust a " << role << " in:\n" << shown;
  }

  template <typename Wish>
  static bool wait_until(const Child& master, const Wish& wish) {
    return test_support::wait_for_progress(master, kPatience, wish);
  }
  static bool is_touching(const Progress& p) { return p.state == "touching" && p.force_N > 0.1; }
  Child start_master(std::vector<std::string> arguments, const std::string& out) {
    arguments.insert(arguments.end(), {"--keys", keys(kOperator), "--device", "simulated", "--seconds", "3600", "--out",
                                       folder_ + "/" + out, "--progress", "machine"});
    return start(kOperator, "farfeel-master", arguments);
  }
  std::vector<std::string> over_relay() const {
    return {"--relay", "relay.example.org", "--relay-token", folder_ + "/token"};
  }
  /// A relay, and a slave that is at it and lets nobody else in.
  std::pair<Child, Child> start_relayed_slave() {
    EXPECT_TRUE(net_->place(kRelay, "198.51.100.1"));
    const std::vector<std::string> key = {"--key", folder_ + "/relay.key"};
    Child token = start(kRelay, "farfeel-relay", {"token", "--days", "1", key[0], key[1]});
    std::ofstream(folder_ + "/token") << said_to_the_end(token).second;
    Child relay = start(kRelay, "farfeel-relay", {"serve", "--listen", "0.0.0.0:47200", key[0], key[1]}, true);
    EXPECT_TRUE(relay.ready_port(std::chrono::duration<double>(kPatience).count(), -1)) << relay.obituary();
    auto arguments = over_relay();
    arguments.insert(arguments.end(), {"--scene", "block-gear", "--listen", "127.0.0.1:0", "--keys", keys(kSlave)});
    Child slave = start(kSlave, "farfeel-slave", arguments, true);
    EXPECT_TRUE(slave.ready_port(std::chrono::duration<double>(kPatience).count(), -1)) << slave.obituary();
    EXPECT_TRUE(wait_for_log(slave, "masters may come over the relay")) << log_of(slave);
    return {std::move(relay), std::move(slave)};
  }
  void end(Child& child) {
    child.signal(SIGTERM);
    EXPECT_EQ(said_to_the_end(child).first, 0) << child.obituary();
  }
  std::string log_of(const Child& child) const {
    std::ifstream file(child.log());
    return {std::istreambuf_iterator<char>(file), {}};
  }

  /// Until it has said that so often.
  bool wait_for_log(const Child& child, const std::string& words, int times = 1) const {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < end) {
      const std::string log = log_of(child);
      int found = 0;
      for (std::size_t at = 0; (at = log.find(words, at)) != std::string::npos; at += words.size()) ++found;
      if (found >= times) return true;
      poll(nullptr, 0, 20);
    }
    return false;
  }

  std::unique_ptr<SimulatedInternet> net_;
  test_support::PrivateFolder private_folder_;
  const std::string folder_ = private_folder_.path();
  int programs_ = 0;
};

TEST_F(TwoMachines, GetToKnowEachOtherAndFeel) {
  if (const std::string why = lay(50 * kMs); !why.empty()) GTEST_SKIP() << why;
  ASSERT_TRUE(net_->place(kOperator, "10.7.0.1") && net_->place(kSlave, "10.7.0.2"));
  const std::string slaves_lines = key_command(kSlave, {"new", "--name", "lab"});
  const std::string operators_lines = key_command(kOperator, {"new", "--name", "anna"});
  paste(slaves_lines, "slave", kOperator);
  Child slave =
      start(kSlave, "farfeel-slave", {"--scene", "block-gear", "--listen", "0.0.0.0:0", "--keys", keys(kSlave)}, true);
  const auto port = slave.ready_port(std::chrono::duration<double>(kPatience).count(), -1);
  ASSERT_TRUE(port) << slave.obituary();
  const std::string address = fmt::format("lab.example.org:{}", *port);

  // Before the slave knows her the operator is told what to do, and nothing is felt.
  Child stranger = start_master({"--connect", address}, "stranger");
  EXPECT_NE(said_to_the_end(stranger).first, 0);
  EXPECT_NE(log_of(stranger).find("does not know this operator"), std::string::npos) << log_of(stranger);

  // While the slave runs, the line is pasted: it counts at once.
  paste(operators_lines, "operator", kSlave);
  Child master = start_master({"--connect", address}, "session");
  ASSERT_TRUE(wait_until(master, is_touching)) << master.obituary() << slave.obituary();

  // Her machine gets another address: the hand feels on.
  ASSERT_TRUE(net_->place(kOperator, "10.7.0.99"));
  EXPECT_TRUE(wait_until(master, [](const Progress& p) { return p.state == "fading" || p.state == "held"; }));
  EXPECT_TRUE(wait_until(master, is_touching)) << master.obituary() << slave.obituary();
  EXPECT_NE(log_of(slave).find("10.7.0.99"), std::string::npos) << log_of(slave);

  // Revoked, she is out within a second.
  const auto revoked = std::chrono::steady_clock::now();
  (void)key_command(kSlave, {"revoke", "anna"});
  EXPECT_TRUE(wait_until(master, [](const Progress& p) { return p.state == "fading"; }));
  EXPECT_LT(std::chrono::steady_clock::now() - revoked, std::chrono::seconds(20));  // far above; not a measurement
  EXPECT_NE(log_of(slave).find("not trusted any more"), std::string::npos) << log_of(slave);
  end(master);
  end(slave);
}

TEST_F(TwoMachines, MeetAtARelayAndFindADirectWay) {
  if (const std::string why = lay(25 * kMs); !why.empty()) GTEST_SKIP() << why;
  ASSERT_TRUE(net_->place(kOperator, "10.0.0.1", SimulatedInternet::BehindNat{"203.0.113.1", kCommonNat}));
  ASSERT_TRUE(net_->place(kSlave, "10.0.0.2", SimulatedInternet::BehindNat{"203.0.113.2", kCommonNat}));
  know_each_other();
  auto [relay, slave] = start_relayed_slave();
  Child master = start_master(over_relay(), "session");
  ASSERT_TRUE(wait_until(master, is_touching)) << log_of(master) << log_of(slave);
  EXPECT_TRUE(wait_for_log(master, "connected over the relay at 198.51.100.1")) << log_of(master);
  EXPECT_TRUE(wait_for_log(master, "directly to 203.0.113.2")) << log_of(master);
  EXPECT_TRUE(wait_until(master, is_touching)) << log_of(master) << log_of(slave);
  EXPECT_GT(net_->passed_two_nats(), 0u);

  // Her machine goes to another network, behind another NAT: by the relay at first, then directly again.
  ASSERT_TRUE(net_->place(kOperator, "192.168.1.7", SimulatedInternet::BehindNat{"203.0.113.9", kCommonNat}));
  EXPECT_TRUE(wait_for_log(master, "the session now goes over the relay")) << log_of(master);
  EXPECT_TRUE(wait_for_log(master, "directly to 203.0.113.2", 2)) << log_of(master);
  EXPECT_TRUE(wait_until(master, is_touching)) << log_of(master) << log_of(slave);
  EXPECT_TRUE(wait_for_log(slave, "the master is at 203.0.113.9")) << log_of(slave);
  end(master);
  end(slave);
  end(relay);
}

TEST_F(TwoMachines, StayAtTheRelayWhereNoOtherWayLeads) {
  if (const std::string why = lay(25 * kMs); !why.empty()) GTEST_SKIP() << why;
  ASSERT_TRUE(net_->place(kOperator, "10.0.0.1", SimulatedInternet::BehindNat{"203.0.113.1", kSymmetricNat}));
  ASSERT_TRUE(net_->place(kSlave, "10.0.0.2", SimulatedInternet::BehindNat{"203.0.113.2", kSymmetricNat}));
  know_each_other();
  auto [relay, slave] = start_relayed_slave();
  Child master = start_master(over_relay(), "session");
  ASSERT_TRUE(wait_until(master, is_touching)) << log_of(master) << log_of(slave);

  // The slave's machine goes to another network.
  ASSERT_TRUE(net_->place(kSlave, "192.168.1.7", SimulatedInternet::BehindNat{"203.0.113.9", kSymmetricNat}));
  EXPECT_TRUE(wait_until(master, [](const Progress& p) { return p.state == "fading" || p.state == "held"; }));
  EXPECT_TRUE(wait_for_log(slave, "sees this slave at 203.0.113.9")) << log_of(slave);
  EXPECT_TRUE(wait_until(master, is_touching)) << log_of(master) << log_of(slave);
  EXPECT_EQ(log_of(master).find("past the relay"), std::string::npos) << log_of(master);
  EXPECT_EQ(net_->passed_two_nats(), 0u);
  end(master);
  end(slave);
  end(relay);
}

TEST_F(TwoMachines, ServeNobodyWithoutKeys) {
  if (const std::string why = lay(0); !why.empty()) GTEST_SKIP() << why;
  Child slave =
      start(kSlave, "farfeel-slave", {"--scene", "block-gear", "--listen", "0.0.0.0:0", "--keys", keys(kSlave)}, true);
  EXPECT_NE(said_to_the_end(slave).first, 0);
  EXPECT_NE(log_of(slave).find("farfeel key new"), std::string::npos) << log_of(slave);
}

}  // namespace
}  // namespace farfeel::end_to_end
