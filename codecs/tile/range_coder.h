// Answers to yes-or-no questions, in as few bits as their models leave to be told.
//
// A range coder (Martin 1979) in the form of LZMA's: 32 bits of range, carries counted. A model's probability is the
// mean of the answers so far, the older ones slowly forgotten. Both ends ask the same questions in the same order;
// whole numbers alone decide, so any two machines agree.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace farfeel::codecs {

/// What is known of one question.
class BitModel {
 public:
  [[nodiscard]] std::uint32_t yes_share(std::uint32_t range) const { return (range >> 12) * (yes_ >> 4); }
  void learn(bool is_yes) {
    const std::int64_t towards = (is_yes ? kOne : 0) - std::int64_t{yes_};
    yes_ = static_cast<std::uint32_t>(std::clamp(yes_ + (towards * kWeights[seen_] >> 16), kLeast, kOne - kLeast));
    seen_ = std::min(seen_ + 1, kMostSeen);
  }

 private:
  static constexpr std::int64_t kOne = 65536, kLeast = 128;
  static constexpr std::uint32_t kMostSeen = 50;
  /// Of the n-th answer against all before, which were half yes, half no to begin with: 1 / (n + 3/2).
  static constexpr std::array<std::int32_t, kMostSeen + 1> kWeights = [] {
    std::array<std::int32_t, kMostSeen + 1> weights{};
    for (std::size_t n = 0; n < weights.size(); ++n) weights[n] = static_cast<std::int32_t>(2 * kOne / (2 * n + 3));
    return weights;
  }();
  std::uint32_t yes_ = kOne / 2, seen_ = 0;
};

class RangeEncoder {
 public:
  /// Appends to `to`, which must outlive it.
  explicit RangeEncoder(std::vector<std::byte>& to) : to_(to), start_(to.size()) {}

  void bit(bool is_yes, BitModel& model) {
    narrow(is_yes, model.yes_share(range_));
    model.learn(is_yes);
  }
  /// Where yes and no are as likely.
  void even_bit(bool is_yes) { narrow(is_yes, range_ >> 1); }
  /// Once, after the last bit: the bytes are whole.
  void finish() {
    for (int i = 0; i < 5; ++i) shift();
    to_.erase(to_.begin() +
              static_cast<std::ptrdiff_t>(start_));  // always 0: what a carry could reach before the first
  }

 private:
  void narrow(bool is_yes, std::uint32_t yes) {
    if (!is_yes) low_ += yes;
    range_ = is_yes ? yes : range_ - yes;
    for (; range_ < 1U << 24; range_ <<= 8) shift();
  }
  /// The top byte of low_ leaves as soon as no carry can reach it any more: it and those of 0xFF after it wait.
  void shift() {
    const auto carry = static_cast<std::uint8_t>(low_ >> 32);
    if (low_ < 0xFF00'0000U || carry != 0) {
      to_.push_back(static_cast<std::byte>(held_ + carry));
      to_.insert(to_.end(), waiting_, static_cast<std::byte>(0xFF + carry));
      waiting_ = 0;
      held_ = static_cast<std::uint8_t>(low_ >> 24);
    } else {
      ++waiting_;
    }
    low_ = (low_ & 0x00FF'FFFFU) << 8;
  }

  std::vector<std::byte>& to_;
  std::size_t start_;
  std::uint64_t low_ = 0;
  std::uint32_t range_ = 0xFFFF'FFFF;
  std::size_t waiting_ = 0;
  std::uint8_t held_ = 0;
};

class RangeDecoder {
 public:
  /// Any bytes: beyond their end zeros are read.
  explicit RangeDecoder(std::span<const std::byte> from) : from_(from) {
    for (int i = 0; i < 4; ++i) code_ = code_ << 8 | next();
  }

  [[nodiscard]] bool bit(BitModel& model) {
    const bool is_yes = narrow(model.yes_share(range_));
    model.learn(is_yes);
    return is_yes;
  }
  [[nodiscard]] bool even_bit() { return narrow(range_ >> 1); }
  /// After the last bit: whether these are what an encoder wrote, no more and no less. Other bytes pass once in 2^32.
  [[nodiscard]] bool is_whole() const { return read_ == from_.size() && code_ == 0; }
  /// No encoder wrote what was asked for so far: what comes are zeros.
  [[nodiscard]] bool is_beyond_end() const { return read_ > from_.size(); }

 private:
  [[nodiscard]] std::uint32_t next() {
    const std::size_t at = read_++;
    return at < from_.size() ? static_cast<std::uint32_t>(from_[at]) : 0;
  }
  [[nodiscard]] bool narrow(std::uint32_t yes) {
    const bool is_yes = code_ < yes;
    if (!is_yes) code_ -= yes;
    range_ = is_yes ? yes : range_ - yes;
    for (; range_ < 1U << 24; range_ <<= 8) code_ = code_ << 8 | next();
    return is_yes;
  }

  std::span<const std::byte> from_;
  std::size_t read_ = 0;
  std::uint32_t code_ = 0, range_ = 0xFFFF'FFFF;
};

}  // namespace farfeel::codecs
