// What the lane sends beside what its sources give it.

#include "transport/bulk/bulk_lane.h"

#include <gtest/gtest.h>

#include <limits>

namespace farfeel::transport {
namespace {

constexpr std::int64_t kMs = 1'000'000;

/// Has some messages to send, and counts what became of them.
class FewMessages final : public BulkSource {
 public:
  explicit FewMessages(int count) : left_(count) {}
  std::optional<std::uint8_t> urgency(std::int64_t) override {
    return left_ > 0 ? std::optional<std::uint8_t>(1) : std::nullopt;
  }
  std::optional<Item> next(std::span<std::byte> to, std::int64_t) override {
    --left_;
    std::fill_n(to.begin(), kBytes, std::byte{7});
    return Item{BulkType::kTile, kBytes, 0};
  }
  void on_arrived(std::uint64_t, std::int64_t) override { ++arrived; }
  void on_lost(std::uint64_t, std::int64_t) override { ++lost; }

  static constexpr std::size_t kBytes = 600;
  int arrived = 0, lost = 0;

 private:
  int left_;
};

BulkOptions seeded(std::uint64_t seed) {
  BulkOptions options;
  options.seed = seed;
  return options;
}

std::shared_ptr<ByteBudget> some_bytes() {
  return std::make_shared<ByteBudget>(1'000'000);
}

/// One message, over a path whose way there and back takes 100 ms.
class BulkLaneWithOneMessage : public ::testing::Test {
 protected:
  BulkLaneWithOneMessage() {
    here.add_source(source);
    here.restart(3, 100 * kMs, kMs);
  }
  BulkLane here{seeded(1), some_bytes()}, there{seeded(2), some_bytes()};
  FewMessages source{1};
  MessageBuffer buffer{};
};

TEST_F(BulkLaneWithOneMessage, TheLossOfTheLastMessageIsToldByTheByteThatFollowsIt) {
  std::int64_t now_ns = 10 * kMs;
  ASSERT_GT(here.next(buffer, now_ns), FewMessages::kBytes);  // this one is lost
  EXPECT_EQ(here.next(buffer, now_ns), 0u);
  // Sooner than the reorder window, one that overtakes it would tell nothing.
  const std::int64_t at_ns = here.next_time_ns(now_ns);
  EXPECT_GT(at_ns, now_ns);
  EXPECT_LT(at_ns, now_ns + 50 * kMs);
  EXPECT_EQ(here.next(buffer, at_ns - 1), 0u);
  now_ns = at_ns;
  const std::size_t size = here.next(buffer, now_ns);
  ASSERT_EQ(size, BulkHead::kBytes + 1);
  (void)there.on_message(std::span(buffer).first(size), now_ns + 50 * kMs);
  EXPECT_EQ(here.next(buffer, now_ns + kMs), 0u) << "the next one leaves a reorder window later";
  now_ns += 50 * kMs;
  const std::size_t receipt = there.next(buffer, now_ns);
  ASSERT_GT(receipt, 0u);
  now_ns += 50 * kMs;
  (void)here.on_message(std::span(buffer).first(receipt), now_ns);
  EXPECT_EQ(source.lost, 1);
  EXPECT_EQ(source.arrived, 0);
  EXPECT_EQ(here.sent().in_flight_bytes(), 0u);
  EXPECT_EQ(here.next_time_ns(now_ns), kNever_ns) << "what only follows is followed by nothing once its fate is told";
}

TEST_F(BulkLaneWithOneMessage, ABurstOfLossesThatTakesTheFollowersTooIsToldByTheFirstThatOutlastsIt) {
  constexpr int kBurst = 5;  // the last message and four that follow it
  std::int64_t now_ns = 10 * kMs;
  const std::int64_t began_ns = now_ns;
  for (int i = 0; i < kBurst; ++i) {
    ASSERT_GT(here.next(buffer, now_ns), 0u) << i;
    now_ns = here.next_time_ns(now_ns);
  }
  EXPECT_EQ(here.counters().silences, 0u);
  const std::size_t size = here.next(buffer, now_ns);
  ASSERT_EQ(size, BulkHead::kBytes + 1);
  (void)there.on_message(std::span(buffer).first(size), now_ns + 50 * kMs);
  now_ns += 50 * kMs;
  const std::size_t receipt = there.next(buffer, now_ns);
  now_ns += 50 * kMs;
  (void)here.on_message(std::span(buffer).first(receipt), now_ns);
  EXPECT_EQ(source.lost, 1);
  EXPECT_EQ(here.counters().silences, 0u) << "told before the silence is, " << (now_ns - began_ns) / kMs << " ms after";
}

TEST_F(BulkLaneWithOneMessage, FollowersEndWhenNothingIsHeard) {
  std::int64_t now_ns = 10 * kMs;
  std::uint64_t bytes = 0;
  while (now_ns != kNever_ns && now_ns < 100'000 * kMs) {
    while (const std::size_t size = here.next(buffer, now_ns)) bytes += size;
    now_ns = here.next_time_ns(now_ns);
  }
  EXPECT_EQ(source.lost, 1);
  EXPECT_LT(bytes, FewMessages::kBytes + BulkHead::kBytes + 10 * (BulkHead::kBytes + 1));
}

TEST(BulkLane, NothingFollowsWhatIsKnownToHaveArrived) {
  BulkLane here(seeded(1), some_bytes()), there(seeded(2), some_bytes());
  FewMessages source(1);
  here.add_source(source);
  MessageBuffer buffer{};
  const std::size_t size = here.next(buffer, 10 * kMs);
  ASSERT_GT(size, 0u);
  (void)there.on_message(std::span(buffer).first(size), 10 * kMs + 200'000);
  const std::size_t receipt = there.next(buffer, 10 * kMs + 300'000);
  ASSERT_GT(receipt, 0u);
  (void)here.on_message(std::span(buffer).first(receipt), 10 * kMs + 500'000);
  EXPECT_EQ(source.arrived, 1);
  EXPECT_EQ(here.next(buffer, 100 * kMs), 0u);
  EXPECT_EQ(here.next_time_ns(100 * kMs), kNever_ns);
}

}  // namespace
}  // namespace farfeel::transport
