#include "codecs/recording/recording.h"

#include <gtest/gtest.h>

#include <random>

namespace farfeel::codecs {
namespace {

Recording any(bool has_values, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> number;
  const auto upto = [&random](std::size_t most) { return random() % (most + 1); };
  Recording recording;
  recording.title = "a session", recording.made_with = "a compiler", recording.has_values = has_values;
  recording.settings = {{"period_ns", "mass_kg"}, {1e6, 0.02}};
  recording.assets = {random(), std::uint64_t{random()} << 40};
  for (const char* name : {"ticks", "answers"}) {
    Stream& stream = recording.streams.emplace_back(Stream{name, {"time_ns", "x"}, {"depths", "force"}, {}});
    for (std::size_t i = 0; i < 50; ++i) {
      Record& record = stream.records.emplace_back();
      record.inputs = {static_cast<double>(1'000'000 * i), number(random)};
      for (std::size_t k = upto(3); k > 0; --k) {
        RecordedMessage& message = record.messages.emplace_back();
        message.kind = static_cast<std::uint8_t>(upto(2));
        message.bytes.resize(upto(1300));
        for (std::byte& byte : message.bytes) byte = static_cast<std::byte>(random());
      }
      Outputs outputs{{"depths", {}}, {"force", {number(random), 0, 0}}};
      for (std::size_t k = upto(4); k > 0; --k) outputs[0].values.push_back(number(random));
      record.outcome = outcome_of(outputs, has_values);
    }
  }
  return recording;
}

TEST(Recording, IsReadAsItWasWritten) {
  for (const bool has_values : {false, true}) {
    const Recording recording = any(has_values, 1);
    const auto again = read_recording(write_recording(recording).value());
    ASSERT_TRUE(again) << again.error();
    EXPECT_EQ(*again, recording);
  }
  EXPECT_EQ(read_recording(write_recording({}).value()).value(), Recording{});
}

TEST(Recording, WhatGoesOnAsItWasCostsNothing) {
  Recording recording = any(false, 2);
  recording.streams.resize(1);
  Stream& stream = recording.streams[0];
  const Record still{{1.25, -3}, {}, outcome_of({{"depths", {}}, {"force", {1}}}, false)};
  stream.records.assign(1000, still);
  const std::size_t hashes = 1000 * (8 + 2 * 2);
  EXPECT_LT(write_recording(recording).value().size(), hashes + 1500);
}

TEST(Recording, CutOrLengthenedIsRefused) {
  const std::vector<std::byte> bytes = write_recording(any(true, 3)).value();
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 16)
    EXPECT_FALSE(read_recording(std::span(bytes).first(size))) << size;
  std::vector<std::byte> longer = bytes;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(read_recording(longer));
}

/// A few bytes cannot ask for more than they may stand for.
TEST(Recording, CountsAreBoundedBeforeAnythingIsAllocated) {
  Recording recording;
  Stream& stream = recording.streams.emplace_back(Stream{"ticks", {}, {}, {}});
  for (std::size_t i = 0; i < 4000; ++i) stream.inputs.push_back("n");
  std::vector<std::byte> bytes = write_recording(recording).value();
  // The count of records is told last, before what is packed, which for none is four bytes.
  bytes[bytes.size() - 5 - 1] = std::byte{0x0F};
  EXPECT_FALSE(read_recording(bytes));
}

TEST(Recording, WhatDoesNotFitItsHeadIsNotWritten) {
  Recording recording = any(false, 4);
  recording.streams[0].records[7].inputs.push_back(0);
  EXPECT_FALSE(write_recording(recording));
  recording = any(false, 4);
  recording.streams[0].records[7].messages.push_back({1, std::vector<std::byte>(kMostMessageBytes + 1)});
  EXPECT_FALSE(write_recording(recording));
  recording = any(false, 4);
  recording.has_values = true;
  EXPECT_FALSE(write_recording(recording));
}

}  // namespace
}  // namespace farfeel::codecs
