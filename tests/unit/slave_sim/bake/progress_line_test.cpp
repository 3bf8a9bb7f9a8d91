#include "slave_sim/bake/progress_line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/private_folder.h"

namespace farfeel::slave_sim {
namespace {

using namespace std::chrono_literals;

constexpr auto kPatience = 30s;

/// What a log was told.
class Log {
 public:
  void take(const std::string& line) {
    const std::scoped_lock lock(mutex_);
    lines_.push_back(line);
    more_.notify_all();
  }
  /// All lines, once there are so many, or after a patience.
  std::vector<std::string> after(std::size_t count) {
    std::unique_lock lock(mutex_);
    more_.wait_for(lock, kPatience, [&] { return lines_.size() >= count; });
    return lines_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable more_;
  std::vector<std::string> lines_;
};

ProgressLine::Out logged(Log& log, std::chrono::milliseconds again) {
  return {
      .to = stdout, .is_terminal = false, .log = [&log](const std::string& line) { log.take(line); }, .again = again};
}

TEST(ProgressLine, AStageThatTakesLongIsToldAgainWithTheTimeSoFar) {
  Log log;
  ProgressLine line(logged(log, 10ms));
  line.show("pieces", 0.25);
  const auto lines = log.after(3);
  ASSERT_GE(lines.size(), 3U);
  for (const std::string& told : lines) {
    EXPECT_EQ(told.find(" 25 % pieces"), 0U) << told;
    EXPECT_TRUE(told.ends_with(" s so far")) << told;
  }
}

TEST(ProgressLine, NothingIsToldBeforeAStageOrAfterTheLast) {
  Log log;
  {
    ProgressLine line(logged(log, 1ms));
    std::this_thread::sleep_for(20ms);
    EXPECT_TRUE(log.after(0).empty());
    line.show("read");
    ASSERT_FALSE(log.after(1).empty());
    line.clear();
    const std::size_t told = log.after(0).size();
    std::this_thread::sleep_for(20ms);
    EXPECT_EQ(log.after(0).size(), told);
  }
  EXPECT_EQ(log.after(0).front().find("read, "), 0U);
}

TEST(ProgressLine, ATerminalHasOneLineThatIsWrittenOverAndGoneInTheEnd) {
  const test_support::PrivateFolder folder;
  std::FILE* const terminal = std::fopen((folder / "shown").c_str(), "w+");
  ASSERT_NE(terminal, nullptr);
  {
    ProgressLine line({.to = terminal, .is_terminal = true, .log = {}, .again = 1h});
    line.show("read");
    line.show("rays", 0.5);
  }
  std::rewind(terminal);
  std::string shown(200, '\0');
  shown.resize(std::fread(shown.data(), 1, shown.size(), terminal));
  std::fclose(terminal);
  EXPECT_EQ(shown.find("\r\033[Kread\r\033[K 50 % rays"), 0U) << shown;
  EXPECT_TRUE(shown.ends_with("\r\033[K")) << shown;
  EXPECT_EQ(std::ranges::count(shown, '\n'), 0);
}

}  // namespace
}  // namespace farfeel::slave_sim
