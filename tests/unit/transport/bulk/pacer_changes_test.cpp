// What happens to a link while bulk runs over it, and what the pacer makes of that. In simulated time.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/transport/bulk/bulk_lab.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

LabOptions options_of(double mbit, double rtt_ms) {
  LabOptions options;
  options.link.path.rate_bit_per_s = 1e6 * mbit;
  options.link.path.round_trip_ns = static_cast<std::int64_t>(1e6 * rtt_ms);
  options.link.path.queue_ns = 200'000'000;
  return options;
}

/// A lab with endless objects under way.
struct Busy {
  explicit Busy(const LabOptions& options) : lab(options) {
    for (std::uint32_t slot = 0; slot < 3; ++slot)
      lab.lane(BulkLab::kSlave).outbox().offer(slot, object, 100, lab.now_ns());
    lab.on_object = [this](const ReceivedObject&) { whole += object->bytes.size(); };
  }
  std::uint64_t here() { return whole + lab.lane(BulkLab::kMaster).inbox().progress().here; }
  /// Goodput [Mbit/s] over the next seconds.
  double goodput(double for_s) {
    const std::uint64_t before = here();
    lab.run_until(lab.now_ns() + static_cast<std::int64_t>(1e9 * for_s));
    return 8e-6 * static_cast<double>(here() - before) / for_s;
  }
  double p99_ms(double for_s) {
    (void)lab.take_round_trips();
    (void)goodput(for_s);
    return quantile_ms(lab.take_round_trips(), 0.99);
  }
  std::shared_ptr<const Object> object = random_object(40'000'000, 7);
  std::uint64_t whole = 0;
  BulkLab lab;
};

TEST(PacerChanges, ALongerRouteIsLearntAndFilledAgain) {
  Busy busy(options_of(20, 20));
  (void)busy.goodput(3);
  LabLink longer = options_of(20, 200).link;
  busy.lab.set_link(longer);
  (void)busy.goodput(7);
  EXPECT_GT(busy.goodput(3), 0.7 * 17);
  EXPECT_LT(busy.p99_ms(2), 200 + 20 + 3);
}

TEST(PacerChanges, AShorterRouteIsLearnt) {
  Busy busy(options_of(20, 200));
  (void)busy.goodput(5);
  busy.lab.set_link(options_of(20, 20).link);
  (void)busy.goodput(4);
  EXPECT_GT(busy.goodput(3), 0.8 * 17);
  EXPECT_LT(busy.p99_ms(2), 20 + 2 + 2);
}

TEST(PacerChanges, ALinkThatGetsSlowOrFastIsFollowed) {
  Busy busy(options_of(100, 20));
  (void)busy.goodput(2);
  busy.lab.set_link(options_of(5, 20).link);
  (void)busy.goodput(5);  // what was under way drains
  EXPECT_GT(busy.goodput(3), 0.75 * 2.4);
  EXPECT_LT(busy.p99_ms(3), 20 + 2 + 4);
  busy.lab.set_link(options_of(100, 20).link);
  (void)busy.goodput(5);
  EXPECT_GT(busy.goodput(2), 0.7 * 97);
}

TEST(PacerChanges, ABlackoutIsOverSoonAfterItEnds) {
  Busy busy(options_of(20, 20));
  (void)busy.goodput(2);
  busy.lab.set_cut(true);
  EXPECT_LT(busy.goodput(5), 0.2);
  busy.lab.set_cut(false);
  (void)busy.goodput(1.5);
  EXPECT_GT(busy.goodput(2), 0.8 * 17);
}

TEST(PacerChanges, LostReceiptsCostLittle) {
  LabOptions options = options_of(20, 20);
  options.receipt_loss = 0.3;
  Busy busy(options);
  (void)busy.goodput(2);
  EXPECT_GT(busy.goodput(3), 0.8 * 17);
  EXPECT_LT(busy.p99_ms(3), 20 + 2 + 2);
}

TEST(PacerChanges, LateWakeUpsCostGoodputAndNotDelay) {
  LabOptions options = options_of(20, 20);
  options.slice_share = 0.01;
  Busy busy(options);
  (void)busy.goodput(2);
  EXPECT_GT(busy.goodput(3), 0.6 * 17);
  EXPECT_LT(busy.p99_ms(3), 20 + 2 + 2.5);
}

TEST(PacerChanges, JitterIsNotTakenForAQueue) {
  LabOptions options = options_of(20, 20);
  options.link.path.jitter_ns = 5'000'000;
  Busy busy(options);
  (void)busy.goodput(3);
  EXPECT_GT(busy.goodput(3), 0.7 * 17);
}

TEST(PacerChanges, AHapticLaneThatBeginsTakesItsShareFirst) {
  LabOptions options = options_of(5, 100);
  options.answer_bytes = 40;
  Busy busy(options);
  (void)busy.goodput(5);
  busy.lab.answer_bytes = 380;  // 3 Mbit/s of the five, from one moment to the next
  const double first_ms = busy.p99_ms(0.5);
  EXPECT_LT(first_ms, 100 + 60);  // the window alone would let it grow for more than a round trip, to twice that
  (void)busy.goodput(2);
  EXPECT_LT(busy.p99_ms(2), 100 + 10 + 4);
}

/// Little to send for a while: its rate is no measure of the link.
TEST(PacerChanges, AnIdlePhaseTeachesNothing) {
  Busy busy(options_of(20, 20));
  (void)busy.goodput(3);
  const double window = busy.lab.lane(BulkLab::kSlave).pacer().window_bytes();
  for (std::uint32_t slot = 0; slot < 3; ++slot)
    busy.lab.lane(BulkLab::kSlave).outbox().withdraw(slot, busy.lab.now_ns());
  busy.lab.run_until(busy.lab.now_ns() + kSecond / 10);
  for (std::uint32_t i = 0; i < 200; ++i) {
    busy.lab.lane(BulkLab::kSlave).outbox().offer(10, random_object(3'000, i), 100, busy.lab.now_ns());
    busy.lab.run_until(busy.lab.now_ns() + kSecond / 20);
  }
  EXPECT_GT(busy.lab.lane(BulkLab::kSlave).pacer().window_bytes(), 0.8 * window);
}

/// No haptic datagram sees it where queues are fair: the lane knows its own queue.
TEST(PacerChanges, TheQueueIsKeptWithoutAnyHapticLane) {
  LabOptions options = options_of(20, 20);
  options.has_haptic = false;
  Busy busy(options);
  (void)busy.goodput(2);
  EXPECT_GT(busy.goodput(3), 0.85 * 20);
  EXPECT_LT(busy.lab.lane(BulkLab::kSlave).pacer().queue_ns(), 2'000'000);
}

TEST(PacerChanges, LargeDatagramsThatVanishBecomeSmaller) {
  LabOptions options = options_of(20, 20);
  options.link.mtu_bytes = kSmallDatagram;
  Busy busy(options);
  (void)busy.goodput(3);
  EXPECT_EQ(busy.lab.lane(BulkLab::kSlave).path_limit().datagram_bytes(), kSmallDatagram);
  EXPECT_GT(busy.goodput(3), 0.75 * 17);
  // A path that takes them is found again, a minute later.
  busy.lab.set_link(options_of(20, 20).link);
  (void)busy.goodput(61);
  busy.lab.lane(BulkLab::kSlave).outbox().offer(9, random_object(100'000, 1), 100, busy.lab.now_ns());
  (void)busy.goodput(1);
  EXPECT_EQ(busy.lab.lane(BulkLab::kSlave).path_limit().datagram_bytes(), kLargeDatagram);
}

TEST(PacerChanges, HeavyLossIsNoReasonForSmallDatagrams) {
  LabOptions options = options_of(20, 20);
  options.link.path.loss = 0.1;
  options.link.path.burst = 4;
  Busy busy(options);
  (void)busy.goodput(10);
  EXPECT_EQ(busy.lab.lane(BulkLab::kSlave).path_limit().datagram_bytes(), kLargeDatagram);
}

}  // namespace
}  // namespace farfeel::transport
