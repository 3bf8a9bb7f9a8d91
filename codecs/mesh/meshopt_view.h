// Buffer views under EXT_meshopt_compression: what their JSON may say, and their bytes unpacked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace farfeel::codecs {

inline constexpr const char* kMeshoptExtension = "EXT_meshopt_compression";

struct MeshoptView {
  enum class Mode { kAttributes, kTriangles, kIndices };
  enum class Filter { kNone, kOctahedral, kQuaternion, kExponential };
  std::size_t buffer = 0, first = 0, bytes = 0;  ///< where the packed bytes are
  std::size_t count = 0, stride = 0;             ///< of elements, and of each unpacked
  Mode mode = Mode::kAttributes;
  Filter filter = Filter::kNone;
  [[nodiscard]] std::size_t unpacked_bytes() const { return count * stride; }
};

/// From a view's extension. Refused: what the extension does not allow, what ends beyond its buffer, and elements more
/// than so many bytes can tell: unpacked is at most 64 times packed.
[[nodiscard]] tl::expected<MeshoptView, std::string> meshopt_view(const nlohmann::json& extension,
                                                                  std::span<const std::uint64_t> buffer_bytes);

/// Bytes may be hostile. `packed`: view.bytes of them.
[[nodiscard]] tl::expected<std::vector<unsigned char>, std::string> unpacked(const MeshoptView&,
                                                                             std::span<const unsigned char> packed);

}  // namespace farfeel::codecs
