// Reads JSON (RFC 8259) from one buffer in one pass: allocates nothing, copies nothing, and never reads beyond the end.
//
// A reader goes down only where the caller knows a key, and skips the rest, checking that it is JSON. It goes kMaxDepth
// deep at most. Strings come as they stand in the text, without their quotes: an escape is not resolved, so a string
// that has one equals no name. The first thing that is not JSON, or not what the caller asks for, ends all: is_good()
// is false from then on, and every function returns at once.
#pragma once

#include <charconv>
#include <cstddef>
#include <string_view>

namespace farfeel::codecs {

class JsonReader {
 public:
  static constexpr int kMaxDepth = 24;
  static constexpr std::size_t kMaxNumber = 64;  ///< characters; no device tells longer ones

  explicit JsonReader(std::string_view text) noexcept : text_(text) {}

  /// An object; on_key(key) has to take the value: by one of these functions, once.
  template <typename OnKey>
  void object(OnKey&& on_key) noexcept {
    if (!open('{')) return;
    if (peek() == '}') return close();
    while (is_good_) {
      const std::string_view key = string();
      if (!take(':')) return;
      on_key(key);
      if (peek() != ',') break;
      ++at_;
    }
    if (take('}')) --depth_;
  }

  /// An array; on_element(index) has to take the value.
  template <typename OnElement>
  void array(OnElement&& on_element) noexcept {
    if (!open('[')) return;
    if (peek() == ']') return close();
    for (std::size_t i = 0; is_good_; ++i) {
      on_element(i);
      if (peek() != ',') break;
      ++at_;
    }
    if (take(']')) --depth_;
  }

  std::string_view string() noexcept;
  double number() noexcept;  ///< finite; one that is too large for a double is no good, one too small is 0
  bool boolean() noexcept;
  void skip() noexcept;  ///< any value

  /// What the next value begins with: { [ " - 0 to 9 t f n; 0 at the end.
  [[nodiscard]] char peek() noexcept;
  /// After the outermost value: nothing may follow but space.
  void end() noexcept {
    if (peek() != 0 || at_ != text_.size()) fail();
  }
  void fail() noexcept { is_good_ = false; }
  [[nodiscard]] bool is_good() const noexcept { return is_good_; }

 private:
  bool open(char bracket) noexcept {
    if (!take(bracket)) return false;
    if (++depth_ > kMaxDepth) fail();
    return is_good_;
  }
  void close() noexcept { ++at_, --depth_; }
  void skip_space() noexcept;
  bool take(char expected) noexcept;
  void word(std::string_view) noexcept;

  std::string_view text_;
  std::size_t at_ = 0;
  int depth_ = 0;
  bool is_good_ = true;
};

}  // namespace farfeel::codecs
