// Told or read: the two ends of a felt stream, with the same words, so that what is told is written down once. Each
// takes a reference, which the teller reads and the reader sets.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/tile/number_coder.h"

namespace farfeel::codecs {

class FeltTeller {
 public:
  static constexpr bool kReads = false;
  explicit FeltTeller(std::vector<std::byte>& to) : coder_(to) {}

  void bit(bool& is_yes, BitModel& model) { coder_.bit(is_yes, model); }
  /// Precondition: |number| <= kMostNumber.
  void number(std::int32_t& number, std::uint64_t around, NumberModels& models) {
    models.write(number, around, coder_);
  }
  /// All bits of a value, which are as likely either way.
  template <typename Value>
  void plain(Value& value) {
    const auto bytes = std::bit_cast<std::array<std::uint8_t, sizeof(Value)>>(value);
    for (const std::uint8_t byte : bytes) {
      for (int i = 0; i < 8; ++i) coder_.even_bit((byte >> i & 1) != 0);
    }
  }
  [[nodiscard]] bool is_good() const { return true; }
  void finish() { coder_.finish(); }

 private:
  RangeEncoder coder_;
};

class FeltReader {
 public:
  static constexpr bool kReads = true;
  explicit FeltReader(std::span<const std::byte> from) : coder_(from) {}

  void bit(bool& is_yes, BitModel& model) { is_yes = coder_.bit(model); }
  void number(std::int32_t& number, std::uint64_t around, NumberModels& models) {
    number = models.read(around, coder_);
  }
  template <typename Value>
  void plain(Value& value) {
    std::array<std::uint8_t, sizeof(Value)> bytes{};
    for (std::uint8_t& byte : bytes) {
      for (int i = 0; i < 8; ++i) byte = static_cast<std::uint8_t>(byte | (coder_.even_bit() ? 1 << i : 0));
    }
    value = std::bit_cast<Value>(bytes);
  }
  /// False where no encoder wrote what was read so far.
  [[nodiscard]] bool is_good() const { return !coder_.is_beyond_end(); }
  [[nodiscard]] bool is_whole() const { return coder_.is_whole(); }

 private:
  RangeDecoder coder_;
};

}  // namespace farfeel::codecs
