// What came out of a tick or an answer: a hash of every bit, a mark of each field, and the values where they are kept.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace farfeel::codecs {

struct Output {
  std::string name;
  std::vector<double> values;  ///< as many as there are: of contacts, so many times their number
};
using Outputs = std::vector<Output>;

struct Outcome {
  std::uint64_t hash = 0;                   ///< of all outputs' bits; every NaN counts as the same
  std::vector<std::uint16_t> marks;         ///< of each output alone: where the hash differs, they tell which one
  std::vector<std::vector<double>> values;  ///< of each output; empty unless they are kept
  friend bool operator==(const Outcome&, const Outcome&) = default;
};

/// FNV-1a.
inline constexpr std::uint64_t kHashBegin = 0xCBF2'9CE4'8422'2325U;
[[nodiscard]] std::uint64_t hashed(std::span<const std::byte>, std::uint64_t begin = kHashBegin) noexcept;

[[nodiscard]] Outcome outcome_of(const Outputs&, bool keeps_values);

struct Difference {
  std::string field;
  std::string how;  ///< what was recorded and what came now; without values, that they differ
};
/// The first output that is not as recorded: bit for bit, or where values were kept and within > 0, by no more than
/// within times the larger one, or times one.
[[nodiscard]] std::optional<Difference> first_difference(const Outcome& recorded, const Outputs& now, double within);

}  // namespace farfeel::codecs
