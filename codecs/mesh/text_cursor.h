// Lines and words of a text that may be hostile.
#pragma once

#include <algorithm>
#include <charconv>
#include <optional>
#include <span>
#include <string_view>

namespace farfeel::codecs {

class TextCursor {
 public:
  explicit TextCursor(std::string_view text) : rest_(text) {}
  explicit TextCursor(std::span<const std::byte> bytes)
      : rest_(reinterpret_cast<const char*>(bytes.data()), bytes.size()) {}

  [[nodiscard]] bool is_at_end() const { return rest_.empty(); }
  [[nodiscard]] std::string_view rest() const { return rest_; }

  /// The next line without its end: "\n", "\r\n", or "\r" alone.
  std::string_view line() {
    const std::string_view line = up_to("\r\n");
    if (line.data() + line.size() != rest_.data() && line.data()[line.size()] == '\r' && rest_.starts_with('\n'))
      rest_.remove_prefix(1);
    return line;
  }
  /// Of a text whose lines end in "\r" alone: a "\n" is none of its ends.
  std::string_view line_to_return() { return up_to("\r"); }
  /// The next word, across lines; empty at the end.
  std::string_view word() {
    const std::size_t begin = rest_.find_first_not_of(" \t\r\n");
    rest_.remove_prefix(begin == std::string_view::npos ? rest_.size() : begin);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n"));
    rest_.remove_prefix(word.size());
    return word;
  }

 private:
  /// What stands before the next of these; that one goes too.
  std::string_view up_to(std::string_view ends) {
    const std::size_t end = std::min(rest_.find_first_of(ends), rest_.size());
    const std::string_view before = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    return before;
  }

  std::string_view rest_;
};

/// The whole word as a number ("nan" and "inf" are numbers here); empty if it is not one.
template <typename Number>
std::optional<Number> number_in(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

}  // namespace farfeel::codecs
