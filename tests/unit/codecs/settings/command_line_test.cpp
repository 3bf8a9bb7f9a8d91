#include "codecs/settings/command_line.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace farfeel::codecs {
namespace {

struct Outcome {
  std::optional<int> status;
  std::string said;
  double seconds = 1;
  std::uint64_t seed = 1;
};

Outcome parsed(std::vector<const char*> arguments) {
  Outcome outcome;
  CLI::App app("of a test", "farfeel-test");
  app.add_option("--seconds", outcome.seconds)->check(CLI::Range(0.1, 86400.0));
  app.add_option("--seed", outcome.seed);
  CLI::App* const check = app.add_subcommand("check", "");
  check->add_flag("--load");
  arguments.insert(arguments.begin(), "farfeel-test");
  testing::internal::CaptureStderr();
  outcome.status = parse_command_line(app, static_cast<int>(arguments.size()), arguments.data());
  outcome.said = testing::internal::GetCapturedStderr();
  return outcome;
}

TEST(CommandLine, RefusesNumbersThatNoProgramCanTake) {
  for (const std::vector<const char*>& wrong : {std::vector<const char*>{"--seconds", "nan"},
                                                {"--seconds=nan"},
                                                {"--seconds", "inf"},
                                                {"--seconds", "1e9"},
                                                {"--seconds", "ten"},
                                                {"--seed", "-1"},
                                                {"--seed=-1"},
                                                {"--seed", "x"},
                                                {"--seed"}}) {
    const Outcome outcome = parsed(wrong);
    EXPECT_EQ(outcome.status, kUsageError) << wrong.front();
    EXPECT_NE(outcome.said.find(std::string(wrong.front()).substr(0, 6)), std::string::npos) << outcome.said;
    EXPECT_NE(outcome.said.find("farfeel-test --help"), std::string::npos) << outcome.said;
  }
  const Outcome right = parsed({"--seconds", "2.5", "--seed", "18446744073709551615"});
  EXPECT_FALSE(right.status);
  EXPECT_EQ(right.seconds, 2.5);
  EXPECT_EQ(right.seed, 18446744073709551615U);
}

TEST(CommandLine, EndsAsACommandThatFailedDoes) {
  CLI::App app("of a test", "farfeel-test");
  app.add_subcommand("measure", "")->callback([] { throw CLI::RuntimeError(7); });
  const std::vector<const char*> arguments{"farfeel-test", "measure"};
  testing::internal::CaptureStderr();
  EXPECT_EQ(parse_command_line(app, 2, arguments.data()), 7);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(CommandLine, NamesTheNearestOptionAndCommand) {
  EXPECT_NE(parsed({"--secnds", "3"}).said.find("did you mean \"--seconds\"?"), std::string::npos);
  EXPECT_NE(parsed({"--secnds=3"}).said.find("did you mean \"--seconds\"?"), std::string::npos);
  EXPECT_NE(parsed({"chekc"}).said.find("no command \"chekc\"; did you mean \"check\"?"), std::string::npos);
  EXPECT_NE(parsed({"check", "--laod"}).said.find("did you mean \"--load\"?"), std::string::npos);
  EXPECT_EQ(parsed({"--zzzzzzzz"}).said.find("did you mean"), std::string::npos);
}

TEST(CommandLine, SaysItsVersionWithBuildKernelAndInstructionSet) {
  testing::internal::CaptureStdout();
  const Outcome outcome = parsed({"--version"});
  const std::string said = testing::internal::GetCapturedStdout();
  EXPECT_EQ(outcome.status, 0);
  for (const char* part : {"farfeel-test 0.", "kernel: Linux", "instruction set: "})
    EXPECT_NE(said.find(part), std::string::npos) << said;
}

}  // namespace
}  // namespace farfeel::codecs
