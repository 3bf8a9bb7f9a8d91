#include "codecs/mesh/glb.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace farfeel::codecs {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF is little-endian, and so is this code");

// Specification constants: glTF 2.0, section "GLB file format".
constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;
// Implementation constant: deeper than any glTF needs.
constexpr int kMostNesting = 32;

std::uint32_t u32_at(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, &bytes[at], sizeof value);
  return value;
}

void put_u32(std::vector<std::byte>& out, std::size_t value) {
  const auto v = static_cast<std::uint32_t>(value);
  const auto* first = reinterpret_cast<const std::byte*>(&v);
  out.insert(out.end(), first, first + sizeof v);
}

bool is_nested_too_deeply(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMostNesting) return true;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return false;
}

}  // namespace

nlohmann::json bounded_json(std::string_view text) {
  if (is_nested_too_deeply(text)) return nlohmann::json(nlohmann::json::value_t::discarded);
  return nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
}

tl::expected<Glb, std::string> split_glb(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeaderBytes + kChunkHeaderBytes) return tl::unexpected(std::string("is too short for a .glb"));
  if (u32_at(bytes, 0) != kMagic) return tl::unexpected(std::string("does not begin as a .glb does"));
  if (u32_at(bytes, 4) != kVersion) return tl::unexpected(fmt::format("is glTF version {}, not 2", u32_at(bytes, 4)));
  if (u32_at(bytes, 8) != bytes.size()) {
    return tl::unexpected(fmt::format("is {} bytes long but says {}", bytes.size(), u32_at(bytes, 8)));
  }
  const std::size_t json_bytes = u32_at(bytes, 12);
  if (u32_at(bytes, 16) != kJsonChunk || json_bytes > bytes.size() - kHeaderBytes - kChunkHeaderBytes) {
    return tl::unexpected(std::string("has no JSON chunk first"));
  }
  Glb glb;
  const auto text = bytes.subspan(kHeaderBytes + kChunkHeaderBytes, json_bytes);
  glb.json = bounded_json({reinterpret_cast<const char*>(text.data()), text.size()});
  if (!glb.json.is_object())
    return tl::unexpected(std::string("has a JSON chunk that is not a JSON object, or nests too deeply"));

  const std::span<const std::byte> rest = bytes.subspan(kHeaderBytes + kChunkHeaderBytes + json_bytes);
  if (rest.empty()) return glb;
  if (rest.size() < kChunkHeaderBytes || u32_at(rest, 4) != kBinaryChunk ||
      u32_at(rest, 0) != rest.size() - kChunkHeaderBytes) {
    return tl::unexpected(std::string("has something other than one binary chunk after its JSON"));
  }
  glb.binary = rest.subspan(kChunkHeaderBytes);
  return glb;
}

std::vector<std::byte> joined_glb(const nlohmann::json& json, std::span<const std::byte> binary) {
  std::string text = json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t padded = (binary.size() + 3) / 4 * 4;
  std::vector<std::byte> out;
  out.reserve(kHeaderBytes + 2 * kChunkHeaderBytes + text.size() + padded);
  put_u32(out, kMagic), put_u32(out, kVersion);
  put_u32(out, kHeaderBytes + 2 * kChunkHeaderBytes + text.size() + padded);
  put_u32(out, text.size()), put_u32(out, kJsonChunk);
  const auto* first = reinterpret_cast<const std::byte*>(text.data());
  out.insert(out.end(), first, first + text.size());
  put_u32(out, padded), put_u32(out, kBinaryChunk);
  out.insert(out.end(), binary.begin(), binary.end());
  out.resize(out.size() + padded - binary.size());
  return out;
}

tl::expected<std::uint64_t, std::string> bounded_integer(const nlohmann::json& object, const char* key,
                                                         std::uint64_t most) {
  if (!object.is_object()) return tl::unexpected(fmt::format("\"{}\" is sought in something that is no object", key));
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number_unsigned() || found->get<std::uint64_t>() > most) {
    return tl::unexpected(fmt::format("\"{}\" is not an integer in 0..{}", key, most));
  }
  return found->get<std::uint64_t>();
}

tl::expected<double, std::string> finite_number(const nlohmann::json& object, const char* key) {
  if (!object.is_object()) return tl::unexpected(fmt::format("\"{}\" is sought in something that is no object", key));
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number() || !std::isfinite(found->get<double>())) {
    return tl::unexpected(fmt::format("\"{}\" is not a finite number", key));
  }
  return found->get<double>();
}

tl::expected<std::span<const std::byte>, std::string> buffer_view(const nlohmann::json& gltf,
                                                                  std::span<const std::byte> binary,
                                                                  std::uint64_t index) {
  const auto views = gltf.find("bufferViews");
  if (views == gltf.end() || !views->is_array() || index >= views->size()) {
    return tl::unexpected(fmt::format("there is no bufferView {}", index));
  }
  const nlohmann::json& view = (*views)[index];
  const auto buffer = bounded_integer(view, "buffer", 0);
  const auto length = bounded_integer(view, "byteLength", binary.size());
  if (!buffer || !length) {
    return tl::unexpected(fmt::format("bufferView {}: {}", index, buffer ? length.error() : buffer.error()));
  }
  std::uint64_t offset = 0;
  if (view.contains("byteOffset")) {
    const auto given = bounded_integer(view, "byteOffset", binary.size());
    if (!given) return tl::unexpected(fmt::format("bufferView {}: {}", index, given.error()));
    offset = *given;
  }
  if (*length > binary.size() - offset)
    return tl::unexpected(fmt::format("bufferView {} ends beyond its buffer", index));
  return binary.subspan(offset, *length);
}

}  // namespace farfeel::codecs
