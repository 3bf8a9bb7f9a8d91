// The window against a set that remembers everything, on random orders, and at the ends of the numbers.

#include "transport/lane/replay_window.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <set>

namespace farfeel::transport {
namespace {

using Verdict = ReplayWindow::Verdict;

TEST(ReplayWindow, AgreesWithASetThatRemembersEverything) {
  std::mt19937_64 random(7);
  for (const std::uint64_t from : {std::uint64_t{0}, std::numeric_limits<std::uint64_t>::max() - 3'000'000}) {
    for (const std::uint64_t spread : {2ull, 100ull, 2'047ull, 2'048ull, 5'000ull, 100'000ull}) {
      ReplayWindow window;
      std::set<std::uint64_t> seen;
      std::uint64_t newest = 0, front = from;
      bool has_any = false;
      for (int i = 0; i < 20'000; ++i) {
        front += random() % 3 == 0 ? random() % spread % 100 : 1;
        const std::uint64_t back = random() % spread;
        const std::uint64_t counter = front - from < back ? front : front - back;
        Verdict expected = Verdict::kNewest;
        if (has_any && counter <= newest) {
          expected = newest - counter >= ReplayWindow::kRemembered || seen.contains(counter) ? Verdict::kDuplicate
                                                                                             : Verdict::kLate;
        }
        ASSERT_EQ(window.accept(counter), expected) << counter << " after " << newest;
        if (expected != Verdict::kDuplicate) seen.insert(counter);
        newest = has_any ? std::max(newest, counter) : counter;
        has_any = true;
      }
    }
  }
}

TEST(ReplayWindow, TakesTheLastNumbersThereAre) {
  constexpr std::uint64_t kLast = std::numeric_limits<std::uint64_t>::max();
  ReplayWindow window;
  EXPECT_EQ(window.accept(kLast - 1), Verdict::kNewest);
  EXPECT_EQ(window.accept(kLast), Verdict::kNewest);
  EXPECT_EQ(window.accept(kLast), Verdict::kDuplicate);
  EXPECT_EQ(window.accept(kLast - 2'047), Verdict::kLate);
  EXPECT_EQ(window.accept(kLast - 2'047), Verdict::kDuplicate);
  EXPECT_EQ(window.accept(kLast - 2'048), Verdict::kDuplicate);
  EXPECT_EQ(window.accept(0), Verdict::kDuplicate);
}

// 14 s without a word at 5 kHz are 70,000 numbers: afterwards the newest is the newest.
TEST(ReplayWindow, GoesOnAfterAGapOfAnyLength) {
  for (const std::uint64_t gap : {1ull, 2'048ull, 65'536ull, 70'000ull, 1ull << 40, 1ull << 63}) {
    ReplayWindow window;
    EXPECT_EQ(window.accept(5), Verdict::kNewest);
    EXPECT_EQ(window.accept(5 + gap), Verdict::kNewest);
    EXPECT_EQ(window.accept(6 + gap), Verdict::kNewest);
    EXPECT_EQ(window.accept(5 + gap), Verdict::kDuplicate);
  }
}

TEST(ReplayWindow, CountsWhatBecameOfThem) {
  ReplayWindow window;
  for (const std::uint64_t counter : {0, 1, 4, 3, 3, 2, 10}) (void)window.accept(counter);
  EXPECT_EQ(window.counters(), (LaneCounters{0, 6, 5, 2, 1, 2, 5}));
  EXPECT_EQ(ReplayWindow().counters(), LaneCounters{});
}

}  // namespace
}  // namespace farfeel::transport
