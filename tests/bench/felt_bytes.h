// What of an asset's bytes is felt.
#pragma once

#include <cstddef>
#include <span>

namespace farfeel::bench {

/// Its felt stream, and the text that describes it; not the drawn mesh, nor its colours. 0: no asset.
[[nodiscard]] std::size_t felt_bytes(std::span<const std::byte> asset);

}  // namespace farfeel::bench
