// What of an asset's bytes is felt.
#pragma once

#include <cstddef>
#include <span>

#include "codecs/asset/asset.h"

namespace farfeel::bench {

/// Its felt stream, and the text that describes it; not the drawn mesh, nor its colours. 0: no asset.
[[nodiscard]] std::size_t felt_bytes(std::span<const std::byte> asset);

/// Of its felt stream, the bytes of each part: what it grows by where the part is there, to some tens of bytes.
struct FeltParts {
  std::size_t coarse = 0;   ///< the coarse mesh
  std::size_t pieces = 0;   ///< which piece and chart each triangle is of, and how thick pieces are
  std::size_t heights = 0;  ///< charts and heights, or the mesh that they follow from
};
[[nodiscard]] FeltParts felt_parts(const codecs::Asset&);

}  // namespace farfeel::bench
