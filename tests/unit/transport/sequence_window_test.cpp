#include "transport/sequence_window.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace farfeel::transport {
namespace {

using Verdict = SequenceWindow::Verdict;

TEST(SequenceWindow, CountsAGapAsLostUntilItIsFilled) {
  SequenceWindow window;
  EXPECT_EQ(window.accept(1), Verdict::kNewest);
  EXPECT_EQ(window.accept(4), Verdict::kNewest);
  EXPECT_EQ(window.counters().lost, 2u);
  EXPECT_EQ(window.accept(3), Verdict::kLate);
  EXPECT_EQ(window.accept(3), Verdict::kDuplicate);
  EXPECT_EQ(window.accept(4), Verdict::kDuplicate);
  EXPECT_EQ(window.counters(), (LaneCounters{0, 3, 1, 1, 2}));
}

TEST(SequenceWindow, CountsTheLossOfASessionsFirstDatagrams) {
  SequenceWindow window;
  window.accept(3);
  EXPECT_EQ(window.counters().lost, 2u);
}

TEST(SequenceWindow, IsUnmovedByAbsurdNumbers) {
  SequenceWindow window;
  window.accept(1);
  EXPECT_EQ(window.accept(0), Verdict::kAbsurd);
  EXPECT_EQ(window.accept(0xFFFF'FFFF), Verdict::kAbsurd);
  EXPECT_EQ(window.accept(2 + SequenceWindow::kMaxJump), Verdict::kAbsurd);
  EXPECT_EQ(window.counters(), (LaneCounters{0, 1, 0, 0, 0}));
  EXPECT_EQ(window.accept(1 + SequenceWindow::kMaxJump), Verdict::kNewest);
}

TEST(SequenceWindow, CallsWhatItNoLongerRemembersADuplicate) {
  SequenceWindow window;
  window.accept(SequenceWindow::kRemembered + 1);
  EXPECT_EQ(window.accept(1), Verdict::kDuplicate);
  EXPECT_EQ(window.accept(2), Verdict::kLate);
}

/// The same verdicts from a set of everything ever seen.
TEST(SequenceWindow, AgreesWithASetOfEverythingSeen) {
  std::mt19937 random(3);
  for (int run = 0; run < 20; ++run) {
    SequenceWindow window;
    std::set<std::uint32_t> seen;
    std::uint32_t newest = 0;
    for (int i = 0; i < 20'000; ++i) {
      const auto back = static_cast<std::int64_t>(random() % (random() % 8 == 0 ? 5000 : 20));
      const auto ahead = static_cast<std::int64_t>(random() % (random() % 100 == 0 ? 4000 : 4));
      const auto sequence = static_cast<std::uint32_t>(std::max<std::int64_t>(1, newest + ahead - back));
      Verdict expected;
      if (sequence > newest) {
        expected = Verdict::kNewest;
        newest = sequence;
        seen.insert(sequence);
      } else if (newest - sequence >= SequenceWindow::kRemembered || seen.count(sequence) != 0) {
        expected = Verdict::kDuplicate;
      } else {
        expected = Verdict::kLate;
        seen.insert(sequence);
      }
      ASSERT_EQ(window.accept(sequence), expected) << sequence;
      ASSERT_EQ(window.counters().received, seen.size());
      ASSERT_EQ(window.counters().lost, newest - seen.size());
    }
  }
}

}  // namespace
}  // namespace farfeel::transport
