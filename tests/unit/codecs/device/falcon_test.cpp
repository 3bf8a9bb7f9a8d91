#include "codecs/device/falcon.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace farfeel::codecs {
namespace {

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

std::string text_of(const FalconPacket& packet) {
  std::string text;
  for (const std::byte byte : packet) text.push_back(static_cast<char>(byte));
  return text;
}

/// A reading as the device writes it: from the public table, without the codec.
std::string written(const FalconReading& reading) {
  std::string text = "<";
  for (const std::int16_t count : reading.counts)
    for (int shift = 0; shift < 16; shift += 4) text.push_back(static_cast<char>('A' + ((count >> shift) & 15)));
  text.push_back(static_cast<char>('A' + reading.buttons + 16 * reading.homed));
  return text + "A>";
}

TEST(FalconPackets, golden_bytes) {
  // The nothing packet and the example of libnifalcon's documents; 0xfa59 is the number that they decode.
  EXPECT_EQ(text_of(encoded({.motors = {}, .lights = 0, .is_homing = false})), "<AAAAAAAAAAAAAA>");
  const auto example = decoded_falcon_reading(bytes_of("<HNGPOKOPFPOPAA>"));
  ASSERT_TRUE(example);
  EXPECT_EQ(example->counts, (std::array<std::int16_t, 3>{-2345, -338, -267}));
  const auto number = decoded_falcon_reading(bytes_of("<JFKPAAAAAAAAAA>"));
  ASSERT_TRUE(number);
  EXPECT_EQ(number->counts[0], static_cast<std::int16_t>(0xfa59));
  // By hand from the table: 4096 = 0x1000, -4096 = 0xf000, 1 = 0x0001; red and homing: 8 + 1 = 'J'.
  EXPECT_EQ(text_of(encoded({.motors = {4096, -4096, 1}, .lights = kFalconRed, .is_homing = true})),
            "<AAABAAAPBAAAJA>");
  const auto pressed = decoded_falcon_reading(bytes_of(std::string("<AAAAAAAAAAAA") + '\xb6' + "?>"));
  ASSERT_TRUE(pressed);  // 0x41 + 0x75
  EXPECT_EQ(pressed->buttons, 5);
  EXPECT_EQ(pressed->homed, 7);
  EXPECT_TRUE(pressed->is_homed());
}

TEST(FalconPackets, every_count_and_every_bit_round_trip) {
  for (int value = -32768; value <= 32767; ++value) {
    const auto count = static_cast<std::int16_t>(value);
    const FalconReading reading{.counts = {count, static_cast<std::int16_t>(~count), 7},
                                .buttons = static_cast<std::uint8_t>(value & 15),
                                .homed = static_cast<std::uint8_t>((value >> 4) & 7)};
    EXPECT_EQ(decoded_falcon_reading(bytes_of(written(reading))), reading);
    // A command's motor values have the same form; its last bits are read as buttons and homed.
    const auto back = decoded_falcon_reading(encoded({.motors = reading.counts, .lights = 0x0e, .is_homing = true}));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->counts, reading.counts);
    EXPECT_EQ(back->buttons, 0x0f);
  }
}

TEST(FalconPackets, what_has_another_form_is_no_reading) {
  const std::string good = "<HNGPOKOPFPOPAA>";
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(decoded_falcon_reading(bytes_of(good.substr(0, size))));
  EXPECT_FALSE(decoded_falcon_reading(bytes_of(good + ">")));
  for (std::size_t at = 0; at < good.size(); ++at)
    for (int value = 0; value < 256; ++value) {
      std::string other = good;
      other[at] = static_cast<char>(value);
      const bool is_marker = at == 0 || at == 15;
      const bool may_be = is_marker  ? other == good
                          : at == 14 ? true
                          : at == 13 ? value >= 0x41 && value <= 0x41 + 0x7f
                                     : value >= 'A' && value <= 'P';
      EXPECT_EQ(decoded_falcon_reading(bytes_of(other)).has_value(), may_be) << at << ' ' << value;
    }
}

TEST(FalconStream, finds_every_packet_however_it_is_split) {
  const FalconReading first{.counts = {1, -2, 3}, .buttons = 1, .homed = 7};
  const FalconReading second{.counts = {-4, 5, -6}, .buttons = 2, .homed = 7};
  const std::string text = written(first) + written(second);
  for (std::size_t a = 0; a <= text.size(); ++a)
    for (std::size_t b = a; b <= text.size(); ++b) {
      FalconStream stream;
      std::optional<FalconReading> newest;
      for (const std::string& part : {text.substr(0, a), text.substr(a, b - a), text.substr(b)})
        if (const auto reading = stream.take(bytes_of(part))) newest = reading;
      EXPECT_EQ(newest, second);
      EXPECT_EQ(stream.readings(), 2U);
      EXPECT_EQ(stream.discarded_bytes(), 0U);
    }
}

TEST(FalconStream, is_back_with_the_first_whole_packet_after_anything) {
  std::mt19937 random(3);
  const FalconReading good{.counts = {100, 200, -300}, .buttons = 4, .homed = 7};
  for (int round = 0; round < 20'000; ++round) {
    FalconStream stream;
    std::string before = written(good).substr(0, random() % 16);  // torn off
    if (round % 2 == 0)
      for (auto n = random() % 40; n > 0; --n) before.push_back(static_cast<char>(random()));
    // Random bytes must not end as the beginning of a packet that swallows the next one's start: that costs one packet.
    (void)stream.take(bytes_of(before));
    auto newest = stream.take(bytes_of(written(good)));
    if (!newest) newest = stream.take(bytes_of(written(good)));
    EXPECT_EQ(newest, good);
  }
}

TEST(FalconStream, a_torn_packet_costs_no_other) {
  const std::string good = written({.counts = {100, 200, -300}, .buttons = 4, .homed = 7});
  for (std::size_t size = 0; size < 16; ++size) {
    FalconStream stream;
    EXPECT_TRUE(stream.take(bytes_of(good.substr(0, size) + good))) << size;
    EXPECT_EQ(stream.discarded_bytes(), size);
  }
}

/// A boot stream with blocks of these sizes [words].
std::vector<std::byte> boot_stream(std::initializer_list<unsigned> sizes) {
  std::vector<std::byte> bytes(22, std::byte{0});
  bytes[0] = std::byte{0xaa}, bytes[1] = std::byte{0x08};
  for (const unsigned words : sizes) {
    bytes.push_back(static_cast<std::byte>(words & 255U));
    bytes.push_back(static_cast<std::byte>(words >> 8U));
    bytes.insert(bytes.end(), 4 + 2 * words, std::byte{0x3f});
  }
  bytes.insert(bytes.end(), 2, std::byte{0});
  return bytes;
}

TEST(FalconFirmware, a_whole_boot_stream_and_nothing_else) {
  const auto good = boot_stream({3, 300, 1});
  EXPECT_EQ(falcon_firmware_trouble(good), "");
  EXPECT_EQ(falcon_firmware_trouble(boot_stream({})), "");
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_NE(falcon_firmware_trouble(std::span(good).first(size)), "") << size;
  auto longer = good;
  longer.push_back(std::byte{0});
  EXPECT_EQ(falcon_firmware_trouble(longer), "goes on after its last block");
  auto other = good;
  other[0] = std::byte{0x7f};
  EXPECT_NE(falcon_firmware_trouble(other), "");
  EXPECT_NE(falcon_firmware_trouble(std::vector<std::byte>(kMostFalconFirmwareBytes + 1)), "");
}

}  // namespace
}  // namespace farfeel::codecs
