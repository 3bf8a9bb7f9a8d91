// "Did you mean ...?"
#pragma once

#include <span>
#include <string_view>

namespace farfeel::codecs {

/// The candidate that takes the fewest insertions, deletions, replacements and swaps of neighbours to reach; empty when
/// even that one is further than half its length.
[[nodiscard]] std::string_view nearest_word(std::string_view word, std::span<const std::string_view> candidates);

}  // namespace farfeel::codecs
