#include "transport/packet.h"

#include <gtest/gtest.h>

#include <array>

namespace farfeel::transport {
namespace {

std::array<std::byte, 3> payload() {
  return {std::byte{1}, std::byte{2}, std::byte{3}};
}

TEST(Packet, ComesBackAsItWasWritten) {
  std::array<std::byte, kMaxDatagramBytes> buffer;
  const auto body = payload();
  const std::size_t size = write_packet({PacketType::kPoseSample, 0x01020304, 77}, body, buffer);
  ASSERT_EQ(size, kHeaderBytes + 3);
  const Packet packet = read_packet(std::span(buffer).first(size));
  ASSERT_TRUE(packet.ok());
  EXPECT_EQ(packet.header.type, PacketType::kPoseSample);
  EXPECT_EQ(packet.header.session, 0x01020304u);
  EXPECT_EQ(packet.header.sequence, 77u);
  EXPECT_TRUE(std::equal(packet.payload.begin(), packet.payload.end(), body.begin(), body.end()));
}

TEST(Packet, IsWrittenAroundAPayloadThatStandsInPlace) {
  std::array<std::byte, 64> buffer{};
  buffer[kHeaderBytes] = std::byte{42};
  const auto body = std::span(buffer).subspan(kHeaderBytes, 1);
  const std::size_t size = write_packet({PacketType::kBye, 1, 1}, body, buffer);
  EXPECT_EQ(read_packet(std::span(buffer).first(size)).payload[0], std::byte{42});
}

TEST(Packet, DoesNotGrowBeyondADatagramOrItsBuffer) {
  std::array<std::byte, 2000> buffer{};
  const std::array<std::byte, kMaxPayloadBytes + 1> body{};
  EXPECT_EQ(write_packet({PacketType::kChunk, 1, 1}, body, buffer), 0u);
  EXPECT_EQ(write_packet({PacketType::kChunk, 1, 1}, std::span(body).first(kMaxPayloadBytes), buffer),
            kMaxDatagramBytes);
  EXPECT_EQ(write_packet({PacketType::kChunk, 1, 1}, std::span(body).first(10), std::span(buffer).first(25)), 0u);
}

TEST(Packet, WithAnyFieldOfTheHeaderBrokenIsRefused) {
  std::array<std::byte, 64> good{};
  const std::size_t size = write_packet({PacketType::kBye, 9, 9}, payload(), good);
  const auto fault_with = [&](std::size_t at, int value) {
    auto bad = good;
    bad[at] = static_cast<std::byte>(value);
    return read_packet(std::span(bad).first(size)).fault;
  };
  EXPECT_EQ(fault_with(0, 'X'), HeaderFault::kNotOurs);
  EXPECT_EQ(fault_with(1, 'X'), HeaderFault::kNotOurs);
  EXPECT_EQ(fault_with(2, 2), HeaderFault::kOtherVersion);
  EXPECT_EQ(fault_with(3, 0), HeaderFault::kUnknownType);
  EXPECT_EQ(fault_with(3, 200), HeaderFault::kUnknownType);
  EXPECT_EQ(fault_with(4, 5), HeaderFault::kLength);
  EXPECT_EQ(fault_with(5, 1), HeaderFault::kLength);
  EXPECT_EQ(fault_with(6, 1), HeaderFault::kLength);
  EXPECT_EQ(fault_with(7, 1), HeaderFault::kLength);
}

TEST(Packet, CutShortOrWithATailIsRefused) {
  std::array<std::byte, 64> good{};
  const std::size_t size = write_packet({PacketType::kBye, 9, 9}, payload(), good);
  for (std::size_t n = 0; n <= good.size(); ++n) {
    if (n == size) continue;
    EXPECT_FALSE(read_packet(std::span(good).first(n)).ok()) << n;
  }
}

}  // namespace
}  // namespace farfeel::transport
