#include "codecs/scene/saved_scene.h"

#include <algorithm>
#include <set>

#include "codecs/text/plain_names.h"
#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {
namespace {

constexpr std::uint32_t kMagic = 0x56534646;  // "FFSV"
constexpr std::uint16_t kVersion = 1;
constexpr std::size_t kHead = 4 + 2 + 2;
constexpr std::size_t kMostName = 64;

bool is_asset_name(std::string_view name) {
  const std::string_view ending = kSavedAssetEnding;
  return name.size() <= kMostName && name.ends_with(ending) &&
         is_plain_name(name.substr(0, name.size() - ending.size()));
}

}  // namespace

std::vector<std::byte> write_saved_scene(std::span<const SavedFile> files) {
  std::size_t size = kHead;
  for (const SavedFile& file : files) size += 1 + file.name.size() + 4 + file.bytes.size();
  std::vector<std::byte> bytes(size);
  transport::ByteWriter w(bytes);
  w.u32(kMagic);
  w.u16(kVersion);
  w.u16(static_cast<std::uint16_t>(files.size()));
  for (const SavedFile& file : files) {
    w.u8(static_cast<std::uint8_t>(file.name.size()));
    w.bytes(std::as_bytes(std::span(file.name)));
    w.u32(static_cast<std::uint32_t>(file.bytes.size()));
    w.bytes(file.bytes);
  }
  return bytes;
}

std::optional<std::vector<SavedFile>> read_saved_scene(std::span<const std::byte> bytes) {
  transport::ByteReader r(bytes);
  if (r.u32() != kMagic || r.u16() != kVersion) return std::nullopt;
  const std::size_t count = r.u16();
  if (!r.ok() || count < 2 || count > kMostSavedFiles) return std::nullopt;
  std::vector<SavedFile> files;
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < count; ++i) {
    const auto name = r.bytes(r.u8());
    const std::string_view text(reinterpret_cast<const char*>(name.data()), name.size());
    const auto content = r.bytes(r.u32());
    const bool is_named = i == 0 ? text == kSavedSceneFile && content.size() <= kMostSavedText : is_asset_name(text);
    if (!r.ok() || content.empty() || !is_named || !names.insert(text).second) return std::nullopt;
    files.push_back({std::string(text), content});
  }
  return r.is_at_end() ? std::optional(std::move(files)) : std::nullopt;
}

}  // namespace farfeel::codecs
