#include "transport/confine/apart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/support/in_child.h"
#include "transport/confine/calls.h"

namespace farfeel::transport {
namespace {

constexpr std::uint64_t kMemory = 256'000'000;
constexpr ApartLimits kLimits{kMemory, 20, 10'000'000};

std::vector<std::byte> question(std::size_t bytes) {
  std::vector<std::byte> all(bytes);
  std::mt19937 random(1);
  for (std::byte& b : all) b = static_cast<std::byte>(random());
  return all;
}
auto ask(const std::string& how, std::size_t bytes = 1000, const ApartLimits& limits = kLimits) {
  return ask_apart({FARFEEL_ANSWERER, how}, question(bytes), limits);
}
std::string reason(const std::string& how, std::size_t bytes = 1000, const ApartLimits& limits = kLimits) {
  const auto answer = ask(how, bytes, limits);
  return answer ? "answered" : answer.error();
}
testing::AssertionResult has(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "'" << text << "' has no '" << part << "'";
}

TEST(Apart, AnswersWithWhatWasMadeOfTheQuestion) {
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{1}, std::size_t{100'000}, std::size_t{9'999'999}}) {
    const auto answer = ask("reverse", bytes);
    ASSERT_TRUE(answer) << answer.error();
    auto expected = question(bytes);
    std::reverse(expected.begin(), expected.end());
    EXPECT_TRUE(*answer == expected) << bytes;
  }
}

TEST(Apart, TellsWhyThereIsNoAnswer) {
  EXPECT_EQ(reason("refuse"), "no?[31m such mesh") << "in letters that a terminal does not obey";
  EXPECT_TRUE(has(reason("end"), "status 3"));
  EXPECT_TRUE(has(reason("be deaf", 5'000'000), "said nothing"));
  EXPECT_TRUE(has(reason("say much", 1'000'000), "larger than the 10000000 bytes"));
  EXPECT_TRUE(has(ask_apart({"/no/such/program"}, {}, kLimits).error(), "cannot start /no/such/program"));
}

TEST(Apart, OutlivesItsEnd) {
  EXPECT_TRUE(has(reason("crash"), "process that decodes"));
  EXPECT_TRUE(has(reason("loop", 10, {kMemory, 1, 100}), "longer"));
  EXPECT_TRUE(has(reason("close and stay", 10, {kMemory, 20, 100}), "decodes was killed"));
}

TEST(Apart, HasSoMuchMemoryAndNoMore) {
#ifdef FARFEEL_SANITIZED
  GTEST_SKIP() << "sanitizers reserve terabytes of addresses: no limit of memory holds beside them";
#endif
  EXPECT_TRUE(has(reason("hoard"), "more than the 256 MB"));
}

TEST(Apart, AsksTheKernelForNothingElse) {
#ifdef FARFEEL_SANITIZED
  GTEST_SKIP() << "in a build with sanitizers this filter lets much through";
#endif
  const auto possible = test_support::in_child([] {
    const auto done = restrict_calls(Calls::kServer);
    return done ? "yes" : done.error();
  });
  if (possible.words != "yes") GTEST_SKIP() << possible.words;
  for (const char* how : {"open", "socket", "run"})
    EXPECT_TRUE(has(reason(how), "asked the kernel for what it may not")) << how;
}

}  // namespace
}  // namespace farfeel::transport
