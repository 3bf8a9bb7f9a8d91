// Which granules of an object are there: one bit each.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

namespace farfeel::transport {

class GranuleMap {
 public:
  GranuleMap() = default;
  explicit GranuleMap(std::uint32_t size) : size_(size), words_((std::size_t{size} + 63) / 64) {}

  [[nodiscard]] std::uint32_t size() const { return size_; }
  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] bool is_full() const { return count_ == size_; }

  /// Sets [begin, end), end <= size(); how many of these were not set before.
  std::uint32_t set(std::uint32_t begin, std::uint32_t end) {
    const std::uint32_t before = count_;
    for (std::uint32_t at = begin; at < end;) {
      const std::uint32_t bit = at % 64, bits = std::min(64 - bit, end - at);
      const std::uint64_t mask = (bits == 64 ? ~0ull : (1ull << bits) - 1) << bit;
      std::uint64_t& word = words_[at / 64];
      count_ += static_cast<std::uint32_t>(std::popcount(mask & ~word));
      word |= mask;
      at += bits;
    }
    return count_ - before;
  }
  void clear() {
    std::fill(words_.begin(), words_.end(), 0);
    count_ = 0;
  }

  /// The first from `from` on that is set, or not set; size() if there is none.
  [[nodiscard]] std::uint32_t next_set(std::uint32_t from) const { return next(from, 0); }
  [[nodiscard]] std::uint32_t next_unset(std::uint32_t from) const { return next(from, ~0ull); }

 private:
  [[nodiscard]] std::uint32_t next(std::uint32_t from, std::uint64_t flip) const {
    if (from >= size_) return size_;
    std::size_t word = from / 64;
    std::uint64_t bits = (words_[word] ^ flip) & (~0ull << (from % 64));
    while (bits == 0) {
      if (++word == words_.size()) return size_;
      bits = words_[word] ^ flip;
    }
    return std::min(size_, static_cast<std::uint32_t>(word * 64 + static_cast<std::size_t>(std::countr_zero(bits))));
  }

  std::uint32_t size_ = 0, count_ = 0;
  std::vector<std::uint64_t> words_;
};

}  // namespace farfeel::transport
