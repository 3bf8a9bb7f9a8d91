// Messages over a stream of bytes: each with its length, of four bytes, before it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace farfeel::codecs {

/// The message with its length before it.
[[nodiscard]] std::vector<std::byte> framed(std::span<const std::byte> message);

/// Puts messages together again from pieces of any size. Holds no more than one message and one piece.
class MessageStream {
 public:
  /// No message is longer, nor of no byte at all: a stream that says otherwise is broken for good.
  explicit MessageStream(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void put(std::span<const std::byte> piece);
  /// The next whole message; valid until the next call of either. Nothing where more has to come.
  [[nodiscard]] std::optional<std::span<const std::byte>> next();
  [[nodiscard]] bool is_broken() const noexcept { return is_broken_; }

 private:
  std::size_t most_bytes_;
  std::vector<std::byte> bytes_;
  std::size_t read_ = 0;  // of bytes_
  bool is_broken_ = false;
};

}  // namespace farfeel::codecs
