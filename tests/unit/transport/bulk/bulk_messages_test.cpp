#include "transport/bulk/bulk_messages.h"

#include <gtest/gtest.h>

#include <random>

namespace farfeel::transport {
namespace {

std::vector<std::byte> bytes_of(std::span<const std::byte> bytes) {
  return {bytes.begin(), bytes.end()};
}

Receipt some_receipt() {
  Receipt m;
  m.newest = 0xFFFF'FFFE, m.echo_us = 7, m.arrival_us = 8, m.hold_us = 9;
  m.ranges = 2, m.range[0] = {0, 5}, m.range[1] = {3, 65'535};
  m.stamps = 1, m.stamp[0] = {4, -300};
  return m;
}

ObjectAnswer some_answer() {
  ObjectAnswer m;
  m.id = 3, m.revision = 9, m.ask = 2, m.round = 1;
  m.ranges = 2, m.range[0] = {0, 5}, m.range[1] = {7, 4'194'304};
  return m;
}

TEST(BulkMessages, KeepTheLayoutOfTheTables) {
  MessageBuffer to;
  const auto head = bytes_of(write(BulkHead{0x29, 0x04030201, 0x08070605, 9}, to));
  EXPECT_EQ(head, (std::vector<std::byte>{std::byte{0x29}, std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4},
                                          std::byte{5}, std::byte{6}, std::byte{7}, std::byte{8}, std::byte{9}}));
  EXPECT_EQ(write(some_receipt(), to).size(), 19u + 2 * 4 + 3);
  EXPECT_EQ(write(ObjectOffer{1, 2, 3, 4, {}}, to).size(), 51u);
  EXPECT_EQ(write(some_answer(), to).size(), 15u + 2 * 8);
  EXPECT_EQ(write(ObjectWithdrawal{1}, to).size(), 5u);
  EXPECT_EQ(write(ObjectPiece{1, 2, std::span(to).first(16)}, std::span(to).subspan(100)).size(), 24u);
}

TEST(BulkMessages, AreReadAsTheyWereWritten) {
  MessageBuffer to;
  const auto receipt = read_receipt(write(some_receipt(), to));
  ASSERT_TRUE(receipt);
  EXPECT_EQ(receipt->newest, 0xFFFF'FFFE);
  EXPECT_EQ(receipt->range[1].length, 65'535);
  EXPECT_EQ(receipt->stamp[0].earlier_us, -300);
  const auto answer = read_object_answer(write(some_answer(), to));
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->range[1].end, 4'194'304u);
  EXPECT_EQ(answer->round, 1);
  const auto offer = read_object_offer(write(ObjectOffer{5, 6, 7, 8, make_object({std::byte{1}})->hash}, to));
  ASSERT_TRUE(offer);
  EXPECT_EQ(offer->hash, make_object({std::byte{1}})->hash);
  EXPECT_EQ(offer->ask, 7);
}

/// At every length but its own, a message is refused.
TEST(BulkMessages, AreRefusedAtAnyOtherLength) {
  MessageBuffer to{};
  const auto check = [](std::span<const std::byte> whole, auto read) {
    ASSERT_FALSE(whole.empty());
    auto bytes = bytes_of(whole);
    ASSERT_TRUE(read(std::span<const std::byte>(bytes)));
    bytes.push_back(std::byte{0});
    EXPECT_FALSE(read(std::span<const std::byte>(bytes)));
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_FALSE(read(std::span<const std::byte>(bytes).first(size)));
  };
  check(write(some_receipt(), to), [](auto b) { return read_receipt(b).has_value(); });
  check(write(some_answer(), to), [](auto b) { return read_object_answer(b).has_value(); });
  check(write(ObjectOffer{1, 2, 3, 4, {}}, to), [](auto b) { return read_object_offer(b).has_value(); });
  check(write(ObjectWithdrawal{1}, to), [](auto b) { return read_object_withdrawal(b).has_value(); });
}

TEST(BulkMessages, ThatContradictThemselvesAreRefused) {
  MessageBuffer to;
  Receipt receipt = some_receipt();
  receipt.ranges = 0;
  EXPECT_FALSE(read_receipt(write(receipt, to)));
  receipt = some_receipt();
  receipt.range[1].gap = 0;
  EXPECT_FALSE(read_receipt(write(receipt, to)));
  receipt = some_receipt();
  receipt.range[0].gap = 1;
  EXPECT_FALSE(read_receipt(write(receipt, to)));
  ObjectAnswer answer = some_answer();
  answer.range[1] = {5, 9};  // touches the first
  EXPECT_FALSE(read_object_answer(write(answer, to)));
  answer = some_answer();
  answer.state = ObjectState::kComplete;  // and yet ranges
  EXPECT_FALSE(read_object_answer(write(answer, to)));
  answer = {};
  answer.id = 1, answer.state = ObjectState::kRefused;  // and no reason
  EXPECT_FALSE(read_object_answer(write(answer, to)));
  EXPECT_FALSE(read_object_offer(write(ObjectOffer{0, 2, 3, 4, {}}, to)));
  EXPECT_FALSE(read_object_offer(write(ObjectOffer{1, 2, 3, 0, {}}, to)));
}

TEST(BulkMessages, DoNotFitIntoLess) {
  MessageBuffer to;
  EXPECT_TRUE(write(some_receipt(), std::span(to).first(29)).empty());
  EXPECT_FALSE(write(some_receipt(), std::span(to).first(30)).empty());
}

}  // namespace
}  // namespace farfeel::transport
