// The binary glTF container: a header, a JSON chunk, and at most one binary chunk. Nothing about what the JSON means,
// except that its nesting and its buffer views are within bounds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace farfeel::codecs {

struct Glb {
  nlohmann::json json;                ///< an object
  std::span<const std::byte> binary;  ///< the binary chunk, a view into what was split; may be empty
};

/// Checks lengths exactly, the JSON's nesting (<= 32) and that it is an object. Bytes may be hostile.
[[nodiscard]] tl::expected<Glb, std::string> split_glb(std::span<const std::byte> bytes);
[[nodiscard]] std::vector<std::byte> joined_glb(const nlohmann::json&, std::span<const std::byte> binary);

/// Parses JSON text, refusing deep nesting before it parses. Discarded (is_discarded()) if malformed.
[[nodiscard]] nlohmann::json bounded_json(std::string_view text);

/// The bytes of bufferViews[index] of a JSON whose only buffer is `binary`; fails unless it lies within.
[[nodiscard]] tl::expected<std::span<const std::byte>, std::string> buffer_view(const nlohmann::json& gltf,
                                                                                std::span<const std::byte> binary,
                                                                                std::uint64_t index);

/// Reads object[key] as an integer in [0, most]; fails with a message that names the key.
[[nodiscard]] tl::expected<std::uint64_t, std::string> bounded_integer(const nlohmann::json& object, const char* key,
                                                                       std::uint64_t most);
/// Reads object[key] as a finite number.
[[nodiscard]] tl::expected<double, std::string> finite_number(const nlohmann::json& object, const char* key);

}  // namespace farfeel::codecs
