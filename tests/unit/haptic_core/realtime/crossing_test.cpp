// Values that cross from one thread to another: whole, in order, and never waited for. Worth running under tsan.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <thread>

#include "haptic_core/realtime/latest_value.h"
#include "haptic_core/realtime/shared_value.h"
#include "haptic_core/realtime/spsc_queue.h"

namespace farfeel::realtime {
namespace {

using Block = std::array<std::uint64_t, 16>;  // every word holds the same number, or the block is torn

Block block_of(std::uint64_t n) {
  Block block{};
  block.fill(n);
  return block;
}

bool is_whole(const Block& block) {
  for (std::uint64_t word : block)
    if (word != block[0]) return false;
  return true;
}

TEST(LatestValueTest, GivesTheInitialValueUntilOneIsStored) {
  LatestValue<int> value(7);
  EXPECT_FALSE(value.refresh());
  EXPECT_EQ(value.latest(), 7);
  value.store(8);
  value.store(9);
  EXPECT_EQ(value.latest(), 7);
  EXPECT_TRUE(value.refresh());
  EXPECT_EQ(value.latest(), 9);
  EXPECT_FALSE(value.refresh());
}

TEST(LatestValueTest, IsNeverTornNorOlderThanBefore) {
  constexpr std::uint64_t kValues = 200'000;
  LatestValue<Block> value;
  std::thread writer([&] {
    for (std::uint64_t n = 1; n <= kValues; ++n) value.store(block_of(n));
  });
  std::uint64_t last = 0;
  while (last < kValues) {
    if (!value.refresh()) continue;
    ASSERT_TRUE(is_whole(value.latest()));
    ASSERT_GT(value.latest()[0], last);
    last = value.latest()[0];
  }
  writer.join();
}

TEST(SpscQueueTest, KeepsOrderAndDropsWhatDoesNotFit) {
  SpscQueue<int> queue(3);
  ASSERT_EQ(queue.capacity(), 4u);
  int value = 0;
  EXPECT_FALSE(queue.pop(value));
  for (int i = 0; i < 6; ++i) EXPECT_EQ(queue.push(i), i < 4);
  EXPECT_EQ(queue.dropped(), 2u);
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(queue.pop(value));
    EXPECT_EQ(value, i);
  }
  EXPECT_FALSE(queue.pop(value));
  EXPECT_TRUE(queue.push(6));
}

TEST(SpscQueueTest, LosesNothingItAcceptedBetweenThreads) {
  constexpr std::uint64_t kValues = 200'000;
  SpscQueue<Block> queue(64);
  std::uint64_t accepted = 0;
  std::atomic<bool> is_done = false;
  std::thread writer([&] {
    for (std::uint64_t n = 1; n <= kValues; ++n)
      if (queue.push(block_of(n))) ++accepted;
    is_done = true;
  });
  std::uint64_t received = 0, last = 0;
  Block block;
  for (;;) {
    const bool was_done = is_done;
    if (!queue.pop(block)) {
      if (was_done) break;
      continue;
    }
    ASSERT_TRUE(is_whole(block));
    ASSERT_GT(block[0], last);
    last = block[0];
    ++received;
  }
  writer.join();
  EXPECT_EQ(received, accepted);
  EXPECT_EQ(accepted + queue.dropped(), kValues);
}

TEST(SharedValueTest, HoldsNothingUntilOneIsStored) {
  SharedValue<Block> value{};
  Block block = block_of(7);
  EXPECT_FALSE(value.load(block));
  EXPECT_EQ(block, block_of(7));
  value.store(block_of(8));
  value.store(block_of(9));
  EXPECT_TRUE(value.load(block));
  EXPECT_EQ(block, block_of(9));
  EXPECT_TRUE(value.load(block)) << "who reads does not take it away";
}

TEST(SharedValueTest, IsNeverTornNorOlderThanBefore) {
  constexpr std::uint64_t kLast = 300'000;
  SharedValue<Block> value{};
  std::thread writer([&] {
    for (std::uint64_t n = 1; n <= kLast; ++n) value.store(block_of(n));
  });
  Block block{};
  for (std::uint64_t before = 0; before < kLast; before = block[0]) {
    if (!value.load(block)) continue;
    ASSERT_TRUE(is_whole(block));
    ASSERT_GE(block[0], before);
  }
  writer.join();
}

}  // namespace
}  // namespace farfeel::realtime
