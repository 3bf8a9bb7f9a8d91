// docs/two-machines.md with the real programs: a slave and an operator in two network namespaces, a cable between them,
// keys of their own, and nothing shared.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include "deploy/front/child.h"
#include "tests/support/network_namespaces.h"
#include "tests/support/wait_for_progress.h"

namespace farfeel::end_to_end {
namespace {

using front::Child;
using front::Progress;
using Side = NetworkNamespaces::Side;

constexpr auto kPatience = std::chrono::seconds(240);  // a first bake included; not a measurement
constexpr Side kOperator = Side::kLeft, kSlave = Side::kRight;

class TwoMachines : public testing::Test {
 protected:
  void SetUp() override {
    auto made = NetworkNamespaces::make();
    if (!made) GTEST_SKIP() << made.error();
    net_.emplace(*std::move(made));
    folder_ = testing::TempDir() + "two_machines_" + testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }

  Child start(Side where, const std::string& name, std::vector<std::string> arguments, bool has_ready = false) {
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
  std::string keys(Side where) const { return folder_ + (where == kOperator ? "/operator" : "/slave"); }
  std::string key_command(Side where, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "key");
    arguments.insert(arguments.end(), {"--folder", keys(where)});
    Child child = start(where, "farfeel", arguments);
    const auto [status, said] = said_to_the_end(child);
    EXPECT_EQ(status, 0) << child.obituary();
    return said;
  }
  /// The line that a person would copy, run at the other machine.
  void paste(const std::string& shown, const std::string& role, Side where) {
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
  Child start_master(const std::string& to, const std::string& out) {
    return start(kOperator, "farfeel-master",
                 {"--connect", to, "--keys", keys(kOperator), "--seconds", "3600", "--out", folder_ + "/" + out,
                  "--progress", "machine"});
  }
  void end(Child& child) {
    child.signal(SIGTERM);
    EXPECT_EQ(said_to_the_end(child).first, 0) << child.obituary();
  }
  std::string log_of(const Child& child) const {
    std::ifstream file(child.log());
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::optional<NetworkNamespaces> net_;
  std::string folder_;
  int programs_ = 0;
};

TEST_F(TwoMachines, GetToKnowEachOtherAndFeel) {
  const std::string slaves_lines = key_command(kSlave, {"new", "--name", "lab"});
  const std::string operators_lines = key_command(kOperator, {"new", "--name", "anna"});
  paste(slaves_lines, "slave", kOperator);
  Child slave =
      start(kSlave, "farfeel-slave", {"--scene", "block-gear", "--listen", "0.0.0.0:0", "--keys", keys(kSlave)}, true);
  const auto port = slave.ready_port(std::chrono::duration<double>(kPatience).count(), -1);
  ASSERT_TRUE(port) << slave.obituary();
  const std::string address = fmt::format("10.7.0.2:{}", *port);

  // Before the slave knows her the operator is told what to do, and nothing is felt.
  Child stranger = start_master(address, "stranger");
  EXPECT_NE(said_to_the_end(stranger).first, 0);
  EXPECT_NE(log_of(stranger).find("does not know this operator"), std::string::npos) << log_of(stranger);

  // While the slave runs, the line is pasted: it counts at once.
  paste(operators_lines, "operator", kSlave);
  Child master = start_master(address, "session");
  ASSERT_TRUE(wait_until(master, is_touching)) << master.obituary() << slave.obituary();

  // Her machine gets another address: the hand feels on.
  net_->in(kOperator,
           [] { ASSERT_TRUE(run_quietly("ip -4 address flush dev cable && ip address add 10.7.0.99/24 dev cable")); });
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

TEST_F(TwoMachines, ServeNobodyWithoutKeys) {
  Child slave =
      start(kSlave, "farfeel-slave", {"--scene", "block-gear", "--listen", "0.0.0.0:0", "--keys", keys(kSlave)}, true);
  EXPECT_NE(said_to_the_end(slave).first, 0);
  EXPECT_NE(log_of(slave).find("farfeel key new"), std::string::npos) << log_of(slave);
}

}  // namespace
}  // namespace farfeel::end_to_end
