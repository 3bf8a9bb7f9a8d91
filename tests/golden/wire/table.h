// Bytes as a protocol's tables write them, to compare messages with.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace farfeel {

/// Appends fields as the tables say: little-endian, one byte at a time, knowing nothing of the code under test.
class Table {
 public:
  Table& u(int bits, std::uint64_t v) {
    for (int shift = 0; shift < bits; shift += 8) bytes_.push_back(static_cast<std::byte>(v >> shift & 0xFF));
    return *this;
  }
  Table& f32(float v) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &v, 4);
    return u(32, bits);
  }
  Table& f64(double v) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &v, 8);
    return u(64, bits);
  }
  Table& text(const std::string& s) {
    for (const char c : s) u(8, static_cast<unsigned char>(c));
    return *this;
  }
  Table& zeros(std::size_t n) {
    bytes_.resize(bytes_.size() + n);
    return *this;
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

inline std::string hex(std::span<const std::byte> bytes) {
  std::string out;
  for (const std::byte b : bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    out += kDigits[std::to_integer<int>(b) >> 4];
    out += kDigits[std::to_integer<int>(b) & 15];
  }
  return out;
}

#define EXPECT_BYTES(written, table) EXPECT_EQ(hex(written), hex((table).bytes()))

}  // namespace farfeel
