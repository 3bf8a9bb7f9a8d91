#include "codecs/recording/outcome.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace farfeel::codecs {
namespace {

std::uint64_t bits_of(double value) {
  return std::bit_cast<std::uint64_t>(std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value);
}

std::uint64_t hash_of(const std::vector<double>& values) {
  std::uint64_t hash = kHashBegin;
  for (const double value : values) {
    const std::uint64_t bits = bits_of(value);
    hash = hashed(std::as_bytes(std::span(&bits, 1)), hash);
  }
  return hash;
}

std::uint16_t mark_of(std::uint64_t hash) {
  return static_cast<std::uint16_t>(hash ^ hash >> 16 ^ hash >> 32 ^ hash >> 48);
}

bool is_within(double a, double b, double within) {
  if (bits_of(a) == bits_of(b)) return true;
  return std::abs(a - b) <= within * std::max({1.0, std::abs(a), std::abs(b)});  // false for NaN
}

std::optional<std::string> difference(const std::vector<double>& recorded, const std::vector<double>& now,
                                      double within) {
  if (recorded.size() != now.size()) return fmt::format("{} numbers, recorded were {}", now.size(), recorded.size());
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (is_within(recorded[i], now[i], within)) continue;
    return fmt::format("number {} is {:.17g}, recorded was {:.17g} (off by {:.3g})", i, now[i], recorded[i],
                       now[i] - recorded[i]);
  }
  return std::nullopt;
}

}  // namespace

std::uint64_t hashed(std::span<const std::byte> bytes, std::uint64_t begin) noexcept {
  for (const std::byte byte : bytes) begin = (begin ^ std::to_integer<std::uint64_t>(byte)) * 0x0000'0100'0000'01B3U;
  return begin;
}

Outcome outcome_of(const Outputs& outputs, bool keeps_values) {
  Outcome outcome;
  outcome.hash = kHashBegin;
  for (const Output& output : outputs) {
    const std::uint64_t hash = hash_of(output.values);
    outcome.hash = hashed(std::as_bytes(std::span(&hash, 1)), outcome.hash);
    outcome.marks.push_back(mark_of(hash));
    if (keeps_values) outcome.values.push_back(output.values);
  }
  return outcome;
}

std::optional<Difference> first_difference(const Outcome& recorded, const Outputs& now, double within) {
  const Outcome here = outcome_of(now, false);
  if (recorded.hash == here.hash) return std::nullopt;
  if (recorded.marks.size() != now.size())
    return Difference{"outputs", fmt::format("there are {}, recorded were {}", now.size(), recorded.marks.size())};
  const bool has_values = recorded.values.size() == now.size();
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (has_values) {
      if (const auto how = difference(recorded.values[i], now[i].values, within)) return Difference{now[i].name, *how};
    } else if (recorded.marks[i] != here.marks[i]) {
      return Difference{now[i].name, "its bits differ"};
    }
  }
  if (has_values) return std::nullopt;
  return Difference{"outputs", "their hash differs"};
}

}  // namespace farfeel::codecs
