#include "codecs/settings/program_options.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

namespace farfeel::codecs {
namespace {

TEST(ProgramOptions, SayWhatTheirRegistrationSays) {
  CLI::App app("of a test", "farfeel-test");
  double force_N = 8;
  unsigned seed = 1;
  std::string grip = "soft", listen = "[::]:1", place;
  bool yes = false;
  app.add_option("--max-force", force_N, "No more than this [N], ever")
      ->check(CLI::Range(0.1, 200.0))
      ->capture_default_str();
  app.add_option("--seed", seed, "Of luck");
  app.add_option("PLACE", place, "stands by itself");
  CLI::App* const serve = app.add_subcommand("serve", "");
  serve->add_option("--grip", grip, "How firm")->check(CLI::IsMember({"soft", "hard"}));
  serve->add_option("--listen", listen, "where [::] is every address");
  serve->add_flag("--yes", yes, "I consent")->configurable(false);
  const auto options = options_of(app);
  ASSERT_EQ(options.size(), 5U);
  const auto told = [&options](std::size_t i) {
    const ProgramOption& o = options[i];
    return std::vector<std::string>{o.command, o.name, o.key, o.unit, o.fallback, o.limits, o.help};
  };
  using Words = std::vector<std::string>;
  EXPECT_EQ(told(0), (Words{"", "--max-force", "max_force", "N", "8", "0.1 to 200", "No more than this, ever"}));
  EXPECT_EQ(told(1), (Words{"", "--seed", "seed", "", "", "0 or more", "Of luck"}));
  EXPECT_EQ(told(2), (Words{"serve", "--grip", "grip", "", "", "soft, hard", "How firm"}));
  EXPECT_EQ(told(3), (Words{"serve", "--listen", "listen", "", "", "", "where [::] is every address"}));
  EXPECT_EQ(told(4), (Words{"serve", "--yes", "", "", "", "true or false", "I consent"}));
  EXPECT_EQ(keys_of(options), (std::vector<std::string>{"grip", "listen", "max_force", "seed"}));
}

TEST(ProgramOptions, OfACommandThatWasNotAskedForTakeNothing) {
  CLI::App app("of a test", "farfeel-test");
  std::string folder;  // one for both, as farfeel key has it
  for (const char* name : {"new", "show"}) app.add_subcommand(name, "")->add_option("--folder", folder);
  const char* const arguments[] = {"farfeel-test", "new", "--folder", "a"};
  app.parse(4, arguments);
  EXPECT_EQ(take_settings(options_of(app), {{"folder", {"b", "FARFEEL_FOLDER"}}}), "");
  EXPECT_EQ(folder, "a");
}

}  // namespace
}  // namespace farfeel::codecs
