// `farfeel key` from two homes: a slave's machine and an operator's.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/unit/transport/keys/small_files.h"
#include "transport/keys/key_folder.h"
#include "transport/keys/key_text.h"

namespace farfeel::transport {
namespace {

struct Said {
  int status = -1;
  std::string text;  ///< both outputs
  bool has(std::string_view part) const { return text.find(part) != std::string::npos; }
};

Said run(const std::string& home, const std::string& shell_line) {
  const std::string line = "cd '" + home + "' && export HOME='" + home +
                           "' && unset XDG_CONFIG_HOME && farfeel() { '" FARFEEL_PROGRAM "' \"$@\"; }; { " +
                           shell_line + "; } 2>&1";
  Said said;
  std::FILE* pipe = popen(line.c_str(), "r");
  if (pipe == nullptr) return said;
  char part[512];
  for (std::size_t n = 0; (n = std::fread(part, 1, sizeof part, pipe)) > 0;) said.text.append(part, n);
  const int status = pclose(pipe);
  said.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return said;
}

// The line of the text that begins with the words, without spaces before it.
std::string line_with(const std::string& text, const std::string& words) {
  const std::size_t begin = text.find(words);
  return begin == std::string::npos ? "" : text.substr(begin, text.find('\n', begin) - begin);
}

struct KeyCommand : testing::Test {
  Said at_slave(const std::string& line) { return run(slave.path(), line); }
  Said at_operator(const std::string& line) { return run(operators.path(), line); }
  KeyFolder folder(const PrivateFolder& home) { return *KeyFolder::open(home / ".config/farfeel/keys"); }

  PrivateFolder slave, operators;
};

TEST_F(KeyCommand, TwoMachinesGetToKnowEachOtherByALineEach) {
  const Said new_slave = at_slave("farfeel key new --name lab"),
             new_operator = at_operator("farfeel key new --name anna");
  ASSERT_EQ(new_slave.status, 0) << new_slave.text;
  ASSERT_EQ(new_operator.status, 0) << new_operator.text;
  const std::string to_slave = line_with(new_operator.text, "farfeel key trust operator anna pub_");
  const std::string to_operator = line_with(new_slave.text, "farfeel key trust slave lab pub_");
  ASSERT_FALSE(to_slave.empty()) << new_operator.text;
  ASSERT_FALSE(to_operator.empty()) << new_slave.text;
  EXPECT_EQ(at_slave(to_slave).status, 0);
  EXPECT_EQ(at_operator(to_operator).status, 0);

  const KeyPair slave_key = *folder(slave).identity(), operator_key = *folder(operators).identity();
  EXPECT_EQ(folder(slave).trusted(Role::kOperator)->find(operator_key.public_key, 0).entry->name, "anna");
  EXPECT_EQ(folder(operators).trusted(Role::kSlave)->find(slave_key.public_key, 0).entry->name, "lab");
  const Said list = at_slave("farfeel key list");
  EXPECT_TRUE(list.has("anna")) << list.text;
  EXPECT_TRUE(list.has(fingerprint(operator_key.public_key))) << list.text;
  EXPECT_TRUE(list.has("no psk")) << list.text;
  EXPECT_TRUE(at_operator("farfeel key show").has(fingerprint(operator_key.public_key)));
  EXPECT_EQ(at_operator("farfeel key show --key-only").text,
            key_to_text(KeyKind::kPublic, operator_key.public_key) + "\n");
}

TEST_F(KeyCommand, ARunningProgramSeesWhoIsTrustedRenewedAndRevoked) {
  ASSERT_EQ(at_slave("farfeel key new").status, 0);
  auto list = *folder(slave).trusted(Role::kOperator);
  const Key32 key = new_key_pair().public_key;
  const std::string trust = "farfeel key trust operator anna " + key_to_text(KeyKind::kPublic, key);

  ASSERT_EQ(at_slave(trust).status, 0);
  EXPECT_TRUE(list.refresh());
  EXPECT_EQ(list.find(key, 0).standing, TrustList::Standing::kTrusted);
  ASSERT_EQ(at_slave("farfeel key psk > psk.txt && " + trust + " --expires 2200-01-31 --psk - < psk.txt").status, 0);
  EXPECT_TRUE(list.refresh());
  const auto found = list.find(key, *end_of_day_ns("2200-01-31"));
  EXPECT_EQ(found.standing, TrustList::Standing::kExpired);
  EXPECT_EQ(key_to_text(KeyKind::kPsk, found.entry->psk_or_zeros()) + "\n", got(slave / "psk.txt"));
  // What is not said stays; what is taken away goes.
  ASSERT_EQ(at_slave(trust + " --expires never").status, 0);
  EXPECT_TRUE(list.refresh());
  EXPECT_FALSE(list.find_name("anna")->expires_ns);
  EXPECT_TRUE(list.find_name("anna")->psk);
  ASSERT_EQ(at_slave(trust + " --psk none").status, 0);
  EXPECT_TRUE(list.refresh());
  EXPECT_FALSE(list.find_name("anna")->psk);

  const Said revoked = at_slave("farfeel key revoke anna");
  EXPECT_EQ(revoked.status, 0) << revoked.text;
  EXPECT_TRUE(list.refresh());
  EXPECT_EQ(list.find(key, 0).standing, TrustList::Standing::kUnknown);
  EXPECT_EQ(at_slave("farfeel key revoke anna").status, 1);
}

TEST_F(KeyCommand, RevokesByRoleWhereTwoMachinesServeEachOther) {
  const std::string key = line_with(at_operator("farfeel key new --key-only").text, "pub_");
  ASSERT_EQ(at_slave("farfeel key trust operator anna " + key).status, 0);
  ASSERT_EQ(at_slave("farfeel key trust slave anna " + key).status, 0);
  ASSERT_EQ(at_slave("farfeel key revoke anna --role slave").status, 0);
  EXPECT_EQ(folder(slave).trusted(Role::kOperator)->entries().size(), 1u);
  EXPECT_EQ(folder(slave).trusted(Role::kSlave)->entries().size(), 0u);
}

TEST_F(KeyCommand, MistakesAreToldWithWhatToDoAndChangeNothing) {
  const Said none = at_slave("farfeel key show");
  EXPECT_EQ(none.status, 1);
  EXPECT_TRUE(none.has("farfeel key new")) << none.text;
  ASSERT_EQ(at_slave("farfeel key new").status, 0);
  const std::string identity = got(slave / ".config/farfeel/keys/identity");
  const Said again = at_slave("farfeel key new");
  EXPECT_EQ(again.status, 1);
  EXPECT_TRUE(again.has("already")) << again.text;
  EXPECT_EQ(got(slave / ".config/farfeel/keys/identity"), identity);

  const std::string key = key_to_text(KeyKind::kPublic, new_key_pair().public_key);
  for (const std::string& wrong :
       {"operator anna " + key.substr(0, 30), "operator anna " + key_to_text(KeyKind::kSecret, new_key_pair().secret),
        "operator 'anna b' " + key, "robot anna " + key, std::string("operator anna"),
        "operator anna " + key + " --expires 2020-01-31", "operator anna " + key + " --expires soon",
        "operator anna " + key + " --psk " + key}) {
    const Said said = at_slave("farfeel key trust " + wrong);
    EXPECT_NE(said.status, 0) << wrong;
    EXPECT_FALSE(said.text.empty()) << wrong;
  }
  EXPECT_TRUE(folder(slave).trusted(Role::kOperator)->entries().empty());
  const Said near = at_slave("farfeel key revok anna");
  EXPECT_EQ(near.status, 2);
  EXPECT_TRUE(near.has("farfeel key revoke")) << near.text;
}

TEST_F(KeyCommand, AKeyThatOthersCanReadIsRefusedUntilTheCommandThatIsToldIsRun) {
  ASSERT_EQ(at_slave("farfeel key new").status, 0);
  for (const std::string path : {".config/farfeel/keys/identity", ".config/farfeel/keys"}) {
    chmod((slave / path).c_str(), 0755);
    const Said refused = at_slave("farfeel key show");
    EXPECT_EQ(refused.status, 1);
    const std::string mend = line_with(refused.text, "chmod ");
    ASSERT_FALSE(mend.empty()) << refused.text;
    EXPECT_EQ(at_slave(mend).status, 0);
    EXPECT_EQ(at_slave("farfeel key show").status, 0);
  }
}

TEST_F(KeyCommand, TakesAFolderAndSpeaksOfPskAndQuantumComputers) {
  EXPECT_EQ(at_slave("farfeel key new --folder other").status, 0);
  EXPECT_EQ(at_slave("farfeel key show --folder other").status, 0);
  EXPECT_EQ(at_slave("farfeel key show").status, 1);
  const Said help = at_slave("farfeel key psk --help");
  EXPECT_EQ(help.status, 0);
  EXPECT_TRUE(help.has("quantum")) << help.text;
  EXPECT_TRUE(at_slave("farfeel key --help").has("farfeel key trust operator anna")) << "an example";
  EXPECT_NE(at_slave("farfeel key psk").text, at_slave("farfeel key psk").text);
}

}  // namespace
}  // namespace farfeel::transport
