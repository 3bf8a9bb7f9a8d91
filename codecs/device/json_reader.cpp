#include "codecs/device/json_reader.h"

#include <cmath>
#include <system_error>

namespace farfeel::codecs {
namespace {

bool is_digit(char c) noexcept {
  return c >= '0' && c <= '9';
}

bool is_hexadecimal(char c) noexcept {
  return is_digit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

}  // namespace

void JsonReader::skip_space() noexcept {
  while (at_ < text_.size() && std::string_view(" \t\n\r").find(text_[at_]) != std::string_view::npos) ++at_;
}

char JsonReader::peek() noexcept {
  skip_space();
  return is_good_ && at_ < text_.size() ? text_[at_] : '\0';
}

bool JsonReader::take(char expected) noexcept {
  if (peek() == expected) {
    ++at_;
  } else {
    fail();
  }
  return is_good_;
}

std::string_view JsonReader::string() noexcept {
  if (!take('"')) return {};
  const std::size_t begin = at_;
  for (; at_ < text_.size(); ++at_) {
    const char c = text_[at_];
    if (c == '"') return text_.substr(begin, at_++ - begin);
    if (static_cast<unsigned char>(c) < 0x20) break;
    if (c != '\\') continue;
    if (++at_ == text_.size()) break;
    if (text_[at_] == 'u') {
      if (text_.size() - at_ < 5) break;
      for (int i = 1; i <= 4; ++i)
        if (!is_hexadecimal(text_[at_ + static_cast<std::size_t>(i)])) fail();
      if (!is_good_) return {};
      at_ += 4;
    } else if (std::string_view("\"\\/bfnrt").find(text_[at_]) == std::string_view::npos) {
      break;
    }
  }
  fail();
  return {};
}

double JsonReader::number() noexcept {
  skip_space();
  const std::size_t begin = at_;
  const auto is_at = [&](char c) { return at_ < text_.size() && text_[at_] == c; };
  const auto digits = [&] {
    const std::size_t first = at_;
    while (at_ < text_.size() && is_digit(text_[at_])) ++at_;
    if (at_ == first) fail();
  };
  if (is_at('-')) ++at_;
  if (is_at('0')) {
    ++at_;
  } else {
    digits();
  }
  if (is_at('.')) {
    ++at_;
    digits();
  }
  if (is_at('e') || is_at('E')) {
    ++at_;
    if (is_at('+') || is_at('-')) ++at_;
    digits();
  }
  if (at_ - begin > kMaxNumber) fail();
  if (!is_good_) return 0;
  double value = 0;
  const auto result = std::from_chars(text_.data() + begin, text_.data() + at_, value);
  if (result.ec == std::errc{} && std::isfinite(value)) return value;
  // Out of range on either side; with so few digits the exponent's sign says which.
  if (text_.substr(begin, at_ - begin).find_first_of("eE") == std::string_view::npos ||
      text_.substr(begin, at_ - begin).find("e-") != std::string_view::npos ||
      text_.substr(begin, at_ - begin).find("E-") != std::string_view::npos)
    return 0;
  fail();
  return 0;
}

void JsonReader::word(std::string_view expected) noexcept {
  if (text_.substr(at_, expected.size()) == expected) {
    at_ += expected.size();
  } else {
    fail();
  }
}

bool JsonReader::boolean() noexcept {
  const bool is = peek() == 't';
  word(is ? "true" : "false");
  return is && is_good_;
}

void JsonReader::skip() noexcept {
  switch (peek()) {
    case '{':
      return object([this](std::string_view) { skip(); });
    case '[':
      return array([this](std::size_t) { skip(); });
    case '"':
      string();
      return;
    case 't':
    case 'f':
      boolean();
      return;
    case 'n':
      return word("null");
    default:
      number();
  }
}

}  // namespace farfeel::codecs
