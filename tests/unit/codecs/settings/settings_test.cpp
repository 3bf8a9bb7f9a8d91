#include "codecs/settings/settings.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "codecs/settings/command_line.h"
#include "tests/support/private_folder.h"

namespace farfeel::codecs {
namespace {

constexpr uid_t kStranger = 12345;

class SettingsFiles : public testing::Test {
 protected:
  void SetUp() override {
    ::setenv("XDG_CONFIG_HOME", folder_.c_str(), 1);
    std::filesystem::create_directory(folder_ + "/farfeel");
  }
  void TearDown() override {
    for (const char* name : {"XDG_CONFIG_HOME", "FARFEEL_SECONDS", "FARFEEL_LOAD", "FARFEEL_NO_SETTINGS", "SUDO_UID"})
      ::unsetenv(name);
  }
  std::string write(const std::string& name, const std::string& text) {
    std::string path = folder_ + "/" + name;
    std::ofstream(path) << text;
    ::chmod(path.c_str(), 0644);
    return path;
  }
  test_support::PrivateFolder place_;
  std::string folder_ = place_.path();
  std::vector<std::string> keys_ = {"max_force", "seconds", "no_view"};
};

TEST_F(SettingsFiles, TheEnvironmentCountsBeforeTheUsersFileAndThatBeforeTheSystems) {
  ::setenv("FARFEEL_SECONDS", "3", 1);
  const std::string users = write("users.toml", "max_force = 2.5\nseconds = 4\n");
  const std::string systems = write("systems.toml", "# ours\nno-view = true\nmax_force = 9\n");
  const auto settings = read_settings({.files = {users, systems}}, keys_);
  ASSERT_TRUE(settings) << settings.error();
  EXPECT_EQ(settings->at("seconds").value, "3");
  EXPECT_EQ(settings->at("seconds").origin, "FARFEEL_SECONDS");
  EXPECT_EQ(settings->at("max_force").value, "2.5");
  EXPECT_EQ(settings->at("max_force").origin, users + ":1");
  EXPECT_EQ(settings->at("no_view").value, "true");
  EXPECT_EQ(settings->at("no_view").origin, systems + ":2");
}

TEST_F(SettingsFiles, AWrongKeyIsToldWithFileLineAndTheNearestOne) {
  const std::string path = write("a.toml", "seconds = 4\n\nmax_frce = 2\n");
  const auto settings = read_settings({.files = {path}}, keys_);
  ASSERT_FALSE(settings);
  EXPECT_EQ(settings.error(), path + ":3: there is no option \"max_frce\"; did you mean \"max_force\"?");
}

TEST_F(SettingsFiles, WhatIsNoSingleValueIsToldWithItsLine) {
  for (const char* text : {"seconds = [1, 2]\n", "[seconds]\nx = 1\n", "seconds = 1979-05-27\n"}) {
    const std::string path = write("a.toml", text);
    const auto settings = read_settings({.files = {path}}, keys_);
    ASSERT_FALSE(settings) << text;
    EXPECT_TRUE(settings.error().starts_with(path + ":1: seconds has to be")) << settings.error();
  }
  const std::string broken = write("a.toml", "seconds = 1\nmax_force =\n");
  EXPECT_TRUE(read_settings({.files = {broken}}, keys_).error().starts_with(broken + ":2: not TOML"));
}

TEST_F(SettingsFiles, AFileThatOthersMayWriteIsRefusedWithWhatMendsIt) {
  const std::string path = write("farfeel/a.toml", "seconds = 1\n");
  ASSERT_TRUE(read_trusted_file(path, this_reader()));
  ::chmod(path.c_str(), 0664);
  EXPECT_NE(read_trusted_file(path, this_reader()).error().find("chmod go-w '" + path), std::string::npos);
  ::chmod(path.c_str(), 0644);
  ::chmod((folder_ + "/farfeel").c_str(), 0777);
  EXPECT_NE(read_trusted_file(path, this_reader()).error().find("others may write " + folder_ + "/farfeel"),
            std::string::npos);
  ::chmod((folder_ + "/farfeel").c_str(), 01777);  // as /tmp is
  EXPECT_TRUE(read_trusted_file(path, this_reader()));
}

TEST_F(SettingsFiles, AStrangersFileIsRefusedAndUnderSudoPassedOver) {
  const std::string path = write("a.toml", "seconds = 1\n");
  if (::geteuid() != 0) {
    EXPECT_NE(read_trusted_file(path, {kStranger, false}).error().find("belongs to user"), std::string::npos);
    EXPECT_EQ(read_trusted_file(path, {0, true}).value(), std::nullopt);
    return;
  }
  ASSERT_EQ(::chown(path.c_str(), kStranger, kStranger), 0);
  EXPECT_NE(read_trusted_file(path, {0, false}).error().find("belongs to user 12345"), std::string::npos);
  EXPECT_EQ(read_trusted_file(path, {0, true}).value(), std::nullopt);
  EXPECT_EQ(read_trusted_file(path, {kStranger, false}).value(), "seconds = 1\n");
}

TEST_F(SettingsFiles, WhatIsNoPlainFileIsNotWaitedFor) {
  const std::string path = folder_ + "/pipe.toml";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  EXPECT_NE(read_trusted_file(path, this_reader()).error().find("no plain file"), std::string::npos);
  EXPECT_EQ(read_trusted_file(folder_ + "/none.toml", this_reader()).value(), std::nullopt);
}

TEST(ThisReader, IsUnderSudoWhereSomebodyElseCalledIt) {
  ::setenv("SUDO_UID", "1000", 1);
  EXPECT_TRUE(this_reader().is_under_sudo);
  ::setenv("SUDO_UID", "0", 1);
  EXPECT_FALSE(this_reader().is_under_sudo);
  ::unsetenv("SUDO_UID");
  EXPECT_FALSE(this_reader().is_under_sudo);
}

struct Outcome {
  std::optional<int> status;
  std::string said;
  double seconds = 1;
  std::string relay, token, scene = "cad", tool;
  bool loads = false;
};

Outcome parsed(std::vector<const char*> arguments) {
  Outcome outcome;
  CLI::App app("of a test", "farfeel-test");
  app.add_option("--seconds", outcome.seconds, "how long [s]")->check(CLI::Range(0.1, 86400.0));
  CLI::Option* const relay = app.add_option("--relay", outcome.relay);
  app.add_option("--relay-token", outcome.token)->needs(relay);
  CLI::Option* const scene = app.add_option("--scene", outcome.scene);
  app.add_option("--tool", outcome.tool)->excludes(scene);
  app.add_flag("--load", outcome.loads)->configurable(true);
  app.add_flag("--yes")->configurable(false);
  arguments.insert(arguments.begin(), "farfeel-test");
  testing::internal::CaptureStderr();
  outcome.status = parse_command_line(app, static_cast<int>(arguments.size()), arguments.data());
  outcome.said = testing::internal::GetCapturedStderr();
  return outcome;
}

TEST_F(SettingsFiles, TheCommandLineCountsBeforeAllElse) {
  write("farfeel/test.toml", "seconds = 4\nload = true\n");
  EXPECT_EQ(parsed({}).seconds, 4);
  EXPECT_TRUE(parsed({}).loads);
  EXPECT_EQ(parsed({"--seconds", "5"}).seconds, 5);
  ::setenv("FARFEEL_SECONDS", "6", 1);
  ::setenv("FARFEEL_LOAD", "false", 1);
  EXPECT_EQ(parsed({}).seconds, 6);
  EXPECT_FALSE(parsed({}).loads);
  EXPECT_EQ(parsed({"--seconds", "5"}).seconds, 5);
  EXPECT_EQ(parsed({"--no-settings"}).seconds, 1);
  ::setenv("FARFEEL_NO_SETTINGS", "1", 1);
  EXPECT_EQ(parsed({}).seconds, 1);
}

TEST_F(SettingsFiles, AWrongSettingEndsTheProgramAsAWrongCommandLineDoes) {
  for (const char* text : {"seconds = nan\n", "seconds = 0\n", "secnds = 1\n", "yes = true\n", "seconds = \"ten\"\n"}) {
    const std::string path = write("farfeel/test.toml", text);
    const Outcome outcome = parsed({});
    EXPECT_EQ(outcome.status, kUsageError) << text;
    EXPECT_NE(outcome.said.find(path + ":1: "), std::string::npos) << outcome.said;
  }
  EXPECT_EQ(parsed({"--no-settings"}).status, std::nullopt);
}

TEST_F(SettingsFiles, WhatASettingNeedsOrExcludesIsThatOfTheWholeCommand) {
  write("farfeel/test.toml", "relay = \"r.example.org\"\nscene = \"gear\"\n");
  const Outcome relayed = parsed({"--relay-token", "t"});
  EXPECT_EQ(relayed.status, std::nullopt) << relayed.said;
  EXPECT_EQ(relayed.relay, "r.example.org");
  EXPECT_EQ(relayed.scene, "gear");
  write("farfeel/test.toml", "tool = \"t.glb\"\n");
  EXPECT_EQ(parsed({}).tool, "t.glb");
  EXPECT_EQ(parsed({"--scene", "gear"}).tool, "") << "the command line's choice excludes the file's";
}

TEST_F(SettingsFiles, AreNotReadByWhatIsNoProgramOfOurs) {
  write("farfeel/count.toml", "nonsense = 1\n");
  CLI::App app("of a test", "farfeel-bench count");
  const char* const arguments[] = {"farfeel-bench"};
  EXPECT_EQ(parse_command_line(app, 1, arguments), std::nullopt);
}

}  // namespace
}  // namespace farfeel::codecs
