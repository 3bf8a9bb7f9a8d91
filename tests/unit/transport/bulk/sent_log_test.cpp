// Numbers, receipts and what is believed of them.

#include "transport/bulk/sent_log.h"

#include <gtest/gtest.h>

#include <set>

#include "transport/bulk/receipt_log.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kMs = 1'000'000;

struct Sender {
  explicit Sender(std::uint64_t seed = 1, std::uint64_t first = 0) : log(seed, first) {}
  BulkHead send() {
    now_ns += kMs;
    const BulkHead head = log.next_head(BulkType::kTile, 1, now_ns);
    SentLog::Message message;
    message.sent_ns = now_ns;
    message.bytes = 1000;
    message.tag = head.number;
    log.add(head, message);
    return head;
  }
  SentLog log;
  std::int64_t now_ns = 0;
};

Receipt receipt_of(const BulkHead& head, std::uint16_t length = 1) {
  Receipt receipt;
  receipt.newest = head.number;
  receipt.echo_us = head.t_send_us;
  receipt.ranges = 1;
  receipt.range[0] = {0, length};
  return receipt;
}

TEST(SentLog, BelievesWhatProvesItsArrival) {
  Sender sender;
  const BulkHead head = sender.send();
  const auto& news = sender.log.on_receipt(receipt_of(head), sender.now_ns + 5 * kMs);
  EXPECT_TRUE(news.is_believed);
  ASSERT_EQ(news.arrived.size(), 1u);
  EXPECT_EQ(sender.log.in_flight_bytes(), 0u);
}

/// Fault 10 of the first transport: acknowledgements of what was never sent, and echoes of times that never were, drove
/// a sender to a thousand times its rate.
TEST(SentLog, BelievesNoNumberThatWasNotSentAndNoTimeThatWasNot) {
  Sender sender;
  const BulkHead head = sender.send();
  Receipt ahead = receipt_of(head);
  ++ahead.newest;
  EXPECT_FALSE(sender.log.on_receipt(ahead, sender.now_ns + kMs).is_believed);
  Receipt early = receipt_of(head);
  ++early.echo_us;
  EXPECT_FALSE(sender.log.on_receipt(early, sender.now_ns + kMs).is_believed);
  EXPECT_EQ(sender.log.in_flight_bytes(), 1000u);
  EXPECT_EQ(sender.log.disbelieved_receipts(), 2u);
}

/// A receiver that got a message now and then, and acknowledges all before it, names a number that was never used.
TEST(SentLog, CatchesAReceiverThatAcknowledgesWhatItDidNotGet) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Sender sender(seed);
    int sent = 0;
    while (!sender.log.has_lied() && sent < 1000) {
      BulkHead head{};
      for (int i = 0; i < 20; ++i, ++sent) head = sender.send();
      (void)sender.log.on_receipt(receipt_of(head, 22), sender.now_ns + kMs);
    }
    EXPECT_TRUE(sender.log.has_lied()) << "seed " << seed;
    EXPECT_LE(sent, 140);
    const BulkHead head = sender.send();
    EXPECT_FALSE(sender.log.on_receipt(receipt_of(head), sender.now_ns + kMs).is_believed);
  }
}

/// Random loss, order and repeats, near the end of the numbers: what the log says arrived is what did, each once.
TEST(SentLog, AgreesWithWhatArrivedWhateverTheOrder) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    std::mt19937_64 random(seed);
    Sender sender(seed, 0xFFFF'FF00);
    ReceiptLog receiver;
    std::set<std::uint64_t> arrived, told;
    std::vector<BulkHead> under_way;
    for (int step = 0; step < 3000; ++step) {
      under_way.push_back(sender.send());
      while (under_way.size() > 8) {
        const std::size_t at = random() % 4;
        const BulkHead head = under_way[at];
        if (random() % 5 != 0) {
          EXPECT_EQ(receiver.note(head, sender.now_ns), arrived.insert(head.number).second);
        }
        if (random() % 10 != 0) under_way.erase(under_way.begin() + static_cast<std::ptrdiff_t>(at));
      }
      const auto receipt = receiver.take_due(sender.now_ns);
      if (!receipt || random() % 3 == 0) continue;
      const auto& news = sender.log.on_receipt(*receipt, sender.now_ns);
      EXPECT_TRUE(news.is_believed);
      for (const auto& fate : news.arrived) EXPECT_TRUE(told.insert(fate.tag).second);
    }
    EXPECT_FALSE(sender.log.has_lied());
    for (const std::uint64_t number : told) EXPECT_TRUE(arrived.contains(number));
    EXPECT_GT(told.size() + 60, arrived.size());
  }
}

TEST(SentLog, WhatWasOvertakenIsLostAndMayYetArrive) {
  Sender sender;
  const BulkHead first = sender.send();
  BulkHead last{};
  for (int i = 0; i < 5; ++i) last = sender.send();
  Receipt receipt = receipt_of(last);
  const auto& news = sender.log.on_receipt(receipt, sender.now_ns + kMs);
  ASSERT_FALSE(news.lost.empty());
  EXPECT_EQ(news.lost.front().tag, first.number);
  const auto& later = sender.log.on_receipt(receipt_of(first), sender.now_ns + 2 * kMs);
  ASSERT_EQ(later.arrived.size(), 1u);
  EXPECT_TRUE(later.arrived.front().was_lost);
  EXPECT_EQ(sender.log.late_messages(), 1u);
}

TEST(ReceiptLog, AnswersTheFirstAtOnceAndLaterOnesAsFarApartAsAsked) {
  ReceiptLog log;
  EXPECT_EQ(log.next_time_ns(), kNever_ns);
  ASSERT_TRUE(log.note({0x2A, 10, 1, 4}, 100 * kMs));
  EXPECT_TRUE(log.take_due(100 * kMs));
  EXPECT_FALSE(log.take_due(100 * kMs));
  ASSERT_TRUE(log.note({0x2A, 12, 2, 4}, 100 * kMs + 1));
  EXPECT_FALSE(log.take_due(100 * kMs + 2));
  const auto receipt = log.take_due(101 * kMs);
  ASSERT_TRUE(receipt);
  EXPECT_EQ(receipt->newest, 12u);
  EXPECT_EQ(receipt->ranges, 2);
  EXPECT_EQ(receipt->range[1].gap, 1);
  EXPECT_EQ(receipt->hold_us, 999u);
  EXPECT_FALSE(log.note({0x2A, 10, 1, 4}, 102 * kMs));
}

}  // namespace
}  // namespace farfeel::transport
