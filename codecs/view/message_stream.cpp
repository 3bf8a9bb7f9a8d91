#include "codecs/view/message_stream.h"

#include <cstring>

namespace farfeel::codecs {

namespace {
constexpr std::size_t kLengthBytes = 4;
}

std::vector<std::byte> framed(std::span<const std::byte> message) {
  const auto length = static_cast<std::uint32_t>(message.size());
  std::vector<std::byte> bytes(kLengthBytes + message.size());
  std::memcpy(bytes.data(), &length, kLengthBytes);
  if (!message.empty()) std::memcpy(bytes.data() + kLengthBytes, message.data(), message.size());
  return bytes;
}

void MessageStream::put(std::span<const std::byte> piece) {
  if (is_broken_) return;
  bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(read_));
  read_ = 0;
  bytes_.insert(bytes_.end(), piece.begin(), piece.end());
}

std::optional<std::span<const std::byte>> MessageStream::next() {
  const std::size_t left = bytes_.size() - read_;
  if (is_broken_ || left < kLengthBytes) return std::nullopt;
  std::uint32_t length = 0;
  std::memcpy(&length, bytes_.data() + read_, kLengthBytes);
  if (length == 0 || length > most_bytes_) {
    is_broken_ = true;
    bytes_.clear();
    read_ = 0;
    return std::nullopt;
  }
  if (left - kLengthBytes < length) return std::nullopt;
  const std::span<const std::byte> message(bytes_.data() + read_ + kLengthBytes, length);
  read_ += kLengthBytes + length;
  return message;
}

}  // namespace farfeel::codecs
