// Whole numbers in a square, each told by how large its neighbours were.
//
// A number's size is 0, or 1 + the bits of |n|'s binary digits after the first (Elias gamma): each step up is a
// question whose answers are learned, apart for every size of neighbourhood; the digits and the sign are as likely
// either way.
#pragma once

#include <bit>
#include <cstdint>
#include <cstdlib>

#include "codecs/tile/range_coder.h"

namespace farfeel::codecs {

inline constexpr std::int32_t kMostNumber = (1 << 24) - 1;  ///< that can be told, of either sign

class NumberModels {
 public:
  /// around: of the magnitudes of neighbours that are known at both ends, a weighted sum.
  void write(std::int32_t number, std::uint64_t around, RangeEncoder& to) {
    auto& steps = of(around);
    const auto magnitude = static_cast<std::uint32_t>(std::abs(number));
    const auto size = static_cast<std::size_t>(std::bit_width(magnitude));
    for (std::size_t i = 0; i < size; ++i) to.bit(true, steps[i]);
    if (size < kMostSize) to.bit(false, steps[size]);
    for (std::size_t digit = size; digit-- > 1;) to.even_bit((magnitude >> (digit - 1) & 1U) != 0);
    if (size > 0) to.even_bit(number < 0);
  }
  /// Of any bytes a number within kMostNumber.
  [[nodiscard]] std::int32_t read(std::uint64_t around, RangeDecoder& from) {
    auto& steps = of(around);
    std::size_t size = 0;
    while (size < kMostSize && from.bit(steps[size])) ++size;
    if (size == 0) return 0;
    std::int32_t magnitude = 1;
    for (std::size_t digit = size; digit-- > 1;)
      magnitude = magnitude << 1 | static_cast<std::int32_t>(from.even_bit());
    return from.even_bit() ? -magnitude : magnitude;
  }

 private:
  static constexpr std::size_t kMostSize = 24, kNeighbourhoods = 16;
  [[nodiscard]] std::array<BitModel, kMostSize>& of(std::uint64_t around) {
    return models_[std::min<std::size_t>(static_cast<std::size_t>(std::bit_width(around)), kNeighbourhoods - 1)];
  }
  std::array<std::array<BitModel, kMostSize>, kNeighbourhoods> models_;
};

}  // namespace farfeel::codecs
