#include "transport/keys/key_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>

#include "transport/seal/macs.h"

namespace farfeel::transport {
namespace {

constexpr std::size_t kCheckBytes = 4;  // with the key's 32 a multiple of 3: base64 without padding or spare bits
constexpr std::size_t kCodedBytes = kKeyBytes + kCheckBytes;
constexpr std::size_t kLetters = kCodedBytes / 3 * 4;
constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
constexpr std::size_t kNameMax = 32;

using Label = std::array<char, 8>;
struct Kind {
  std::string_view prefix;
  Label check_label;
  std::string_view words;
};
// In the order of KeyKind.
constexpr std::array<Kind, 3> kKinds = {{
    {"pub_", {'p', 'u', 'b', '-', 't', 'e', 'x', 't'}, "a public key"},
    {"secret_", {'s', 'e', 'c', '-', 't', 'e', 'x', 't'}, "a secret key"},
    {"psk_", {'p', 's', 'k', '-', 't', 'e', 'x', 't'}, "a pre-shared key"},
}};
const Kind& kind_of(KeyKind kind) {
  return kKinds[static_cast<std::size_t>(kind)];
}
constexpr Label kFingerprintLabel = {'f', 'i', 'n', 'g', 'e', 'r', 'p', 'r'};

using Coded = std::array<std::byte, kCodedBytes>;

// The key, and the hash that tells a slip of the hand.
Coded with_check(KeyKind kind, const Key32& key) {
  Coded coded;
  const Key32 check = labelled_key(kind_of(kind).check_label, key);
  std::ranges::copy(key, coded.begin());
  std::copy_n(check.begin(), kCheckBytes, coded.begin() + kKeyBytes);
  return coded;
}

tl::unexpected<KeysError> malformed(std::string message) {
  return tl::unexpected(KeysError{KeysErrorKind::kMalformed, std::move(message)});
}

bool is_letter_or_digit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}
bool is_name_letter(char c) {
  return is_letter_or_digit(c) || c == '.' || c == '-' || c == '_';
}

using Days = std::chrono::sys_days;
constexpr int kFirstYear = 1970, kLastYear = 2261;  // nanoseconds since 1970 fill 63 bits in April 2262
constexpr std::int64_t kDay_ns = 86'400'000'000'000;

}  // namespace

std::string key_to_text(KeyKind kind, const Key32& key) {
  Coded coded = with_check(kind, key);
  std::string text(kind_of(kind).prefix);
  text.reserve(text.size() + kLetters);
  for (std::size_t i = 0; i < coded.size(); i += 3) {
    const unsigned bits = std::to_integer<unsigned>(coded[i]) << 16 | std::to_integer<unsigned>(coded[i + 1]) << 8 |
                          std::to_integer<unsigned>(coded[i + 2]);
    for (const int shift : {18, 12, 6, 0}) text += kAlphabet[bits >> shift & 63];
  }
  wipe(coded);
  return text;
}

KeysResult<Key32> key_from_text(KeyKind kind, std::string_view text) {
  const Kind& wanted = kind_of(kind);
  if (!text.starts_with(wanted.prefix)) {
    for (const Kind& other : kKinds)
      if (text.starts_with(other.prefix))
        return malformed(fmt::format("this is {}, and {} is wanted here: the word that begins with {}", other.words,
                                     wanted.words, wanted.prefix));
    return malformed(fmt::format("{} begins with {}: copy the whole word", wanted.words, wanted.prefix));
  }
  const std::string_view letters = text.substr(wanted.prefix.size());
  if (letters.size() != kLetters)
    return malformed(fmt::format("{} has {} letters after {}, and this one has {}: copy the whole word", wanted.words,
                                 kLetters, wanted.prefix, letters.size()));
  Coded coded;
  for (std::size_t i = 0; i < letters.size(); i += 4) {
    unsigned bits = 0;
    for (const char c : letters.substr(i, 4)) {
      const std::size_t value = kAlphabet.find(c);
      if (value == std::string_view::npos)
        return malformed(fmt::format("{} has letters, digits, - and _ alone: copy the whole word", wanted.words));
      bits = bits << 6 | static_cast<unsigned>(value);
    }
    for (std::size_t b = 0; b < 3; ++b) coded[i / 4 * 3 + b] = static_cast<std::byte>(bits >> (16 - 8 * b));
  }
  Key32 key;
  std::copy_n(coded.begin(), key.size(), key.begin());
  Coded right = with_check(kind, key);
  const bool is_right = is_same_secret(right, coded);
  wipe(coded);
  wipe(right);
  if (!is_right) {
    wipe(key);
    return malformed(fmt::format("{} has a wrong letter in it: copy it again", wanted.words));
  }
  return key;
}

std::string fingerprint(const Key32& public_key) {
  const Key32 hash = labelled_key(kFingerprintLabel, public_key);
  std::string text;
  for (std::size_t group = 0; group < 6; ++group) {
    std::uint64_t number = 0;  // 40 bits a group: their remainder by 100,000 is as good as even
    for (std::size_t i = 0; i < 5; ++i) number = number << 8 | std::to_integer<std::uint64_t>(hash[5 * group + i]);
    text += fmt::format("{}{:05}", group == 0 ? "" : " ", number % 100'000);
  }
  return text;
}

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= kNameMax && is_letter_or_digit(text.front()) &&
         std::ranges::all_of(text, is_name_letter);
}

std::string as_name(std::string_view text) {
  std::string name;
  for (const char c : text)
    if (name.size() < kNameMax && (name.empty() ? is_letter_or_digit(c) : is_name_letter(c))) name += c;
  return name.empty() ? "this-machine" : name;
}

KeysResult<std::int64_t> end_of_day_ns(std::string_view date) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  bool is_form = date.size() == 10;
  for (std::size_t i = 0; is_form && i < date.size(); ++i)
    is_form = i == 4 || i == 7 ? date[i] == '-' : is_digit(date[i]);
  if (!is_form) return malformed(fmt::format("a date is written as 2027-01-31, and this is \"{}\"", date));
  const auto number = [&](std::size_t at, std::size_t digits) {
    int value = 0;
    for (const char c : date.substr(at, digits)) value = 10 * value + (c - '0');
    return value;
  };
  const std::chrono::year_month_day day{std::chrono::year(number(0, 4)),
                                        std::chrono::month(static_cast<unsigned>(number(5, 2))),
                                        std::chrono::day(static_cast<unsigned>(number(8, 2)))};
  if (!day.ok() || number(0, 4) < kFirstYear || number(0, 4) > kLastYear)
    return malformed(fmt::format("there is no day {} between {} and {}", date, kFirstYear, kLastYear));
  return (Days(day).time_since_epoch().count() + 1) * kDay_ns;
}

std::string date_ending_at(std::int64_t end_ns) {
  const std::chrono::year_month_day day{Days(std::chrono::days((end_ns - 1) / kDay_ns))};
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(day.year()), static_cast<unsigned>(day.month()),
                     static_cast<unsigned>(day.day()));
}

}  // namespace farfeel::transport
