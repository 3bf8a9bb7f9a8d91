#include "codecs/tile/tile_codec.h"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace farfeel::codecs {
namespace {

using geometry::kTileSide;

static_assert(std::endian::native == std::endian::little, "the layout is little-endian, and so is this code");

// Specification constants.
constexpr std::uint8_t kFormat = 1, kRaw = 0, kPredicted = 1;
constexpr std::uint32_t kHalf = kTileSide / 2;
// Implementation constant: the fastest level; higher ones gain a few per cent.
constexpr int kLevel = 1;

/// From the left a, above b and above left c: the least of a and b at an edge, their plane where it is smooth.
std::uint16_t median_edge_prediction(int a, int b, int c) {
  if (c >= std::max(a, b)) return static_cast<std::uint16_t>(std::min(a, b));
  if (c <= std::min(a, b)) return static_cast<std::uint16_t>(std::max(a, b));
  return static_cast<std::uint16_t>(a + b - c);
}

std::uint16_t prediction(const std::vector<std::uint16_t>& values, std::size_t row, std::size_t column) {
  const std::size_t at = row * kTileSide + column;
  if (row == 0) return column == 0 ? 0 : values[at - 1];
  if (column == 0) return values[at - kTileSide];
  return median_edge_prediction(values[at - 1], values[at - kTileSide], values[at - kTileSide - 1]);
}

// Differences wrap round 2^16; zigzag brings small ones of either sign near zero: 0, -1, 1, -2, ...
std::uint16_t zigzag(std::uint16_t difference) {
  return static_cast<std::uint16_t>(difference << 1 ^ ((difference & 0x8000U) != 0 ? 0xFFFFU : 0U));
}
std::uint16_t unzigzag(std::uint16_t z) {
  return static_cast<std::uint16_t>(z >> 1 ^ ((z & 1U) != 0 ? 0xFFFFU : 0U));
}

std::vector<std::byte> part(std::uint32_t tile, const geometry::HeightTile& in, std::uint32_t first_row,
                            std::uint32_t rows) {
  const std::size_t count = std::size_t{rows} * kTileSide;
  std::vector<std::uint16_t> values(count);
  std::copy_n(in.coefficients.begin() + first_row * kTileSide, count, values.begin());
  std::vector<std::byte> planes(2 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto difference = static_cast<std::uint16_t>(values[i] - prediction(values, i / kTileSide, i % kTileSide));
    const std::uint16_t z = zigzag(difference);
    planes[i] = static_cast<std::byte>(z >> 8);
    planes[count + i] = static_cast<std::byte>(z & 0xFF);
  }
  std::vector<std::byte> out(kTilePartHeaderBytes + ZSTD_compressBound(planes.size()));
  const std::size_t packed = ZSTD_compress(&out[kTilePartHeaderBytes], out.size() - kTilePartHeaderBytes, planes.data(),
                                           planes.size(), kLevel);
  const bool is_shorter = ZSTD_isError(packed) == 0 && packed < planes.size();
  if (!is_shorter) std::memcpy(&out[kTilePartHeaderBytes], values.data(), 2 * count);
  out.resize(kTilePartHeaderBytes + (is_shorter ? packed : 2 * count));
  out[0] = std::byte{kFormat};
  out[1] = std::byte{is_shorter ? kPredicted : kRaw};
  out[2] = static_cast<std::byte>(first_row);
  out[3] = static_cast<std::byte>(rows);
  std::memcpy(&out[4], &tile, sizeof tile);
  std::memcpy(&out[8], &in.version, sizeof in.version);
  return out;
}

tl::unexpected<std::string> wrong(const char* why) {
  return tl::unexpected(std::string("a tile's part ") + why);
}

}  // namespace

std::vector<std::vector<std::byte>> encoded_tile(std::uint32_t tile, const geometry::HeightTile& in) {
  std::vector<std::byte> whole = part(tile, in, 0, kTileSide);
  if (whole.size() <= kMostPartBytes) return {std::move(whole)};
  return {part(tile, in, 0, kHalf), part(tile, in, kHalf, kHalf)};
}

tl::expected<TilePart, std::string> decoded_tile_part(std::span<const std::byte> bytes) {
  if (bytes.size() < kTilePartHeaderBytes || bytes.size() > kMostPartBytes) return wrong("has a length that none has");
  const auto coding = static_cast<std::uint8_t>(bytes[1]);
  if (static_cast<std::uint8_t>(bytes[0]) != kFormat || coding > kPredicted) return wrong("is of an unknown format");
  TilePart out;
  out.first_row = static_cast<std::uint8_t>(bytes[2]);
  out.rows = static_cast<std::uint8_t>(bytes[3]);
  const bool is_whole = out.first_row == 0 && out.rows == kTileSide;
  const bool is_half = out.rows == kHalf && (out.first_row == 0 || out.first_row == kHalf);
  if (!is_whole && !is_half) return wrong("has rows that none has");
  std::memcpy(&out.tile, &bytes[4], sizeof out.tile);
  std::memcpy(&out.version, &bytes[8], sizeof out.version);

  const std::size_t count = std::size_t{out.rows} * kTileSide;
  const std::span<const std::byte> payload = bytes.subspan(kTilePartHeaderBytes);
  out.coefficients.resize(count);
  if (coding == kRaw) {
    if (payload.size() != 2 * count) return wrong("is raw but has another length");
    std::memcpy(out.coefficients.data(), payload.data(), payload.size());
    return out;
  }
  std::array<std::byte, 2 * geometry::kTileSide * geometry::kTileSide> planes;
  if (ZSTD_getFrameContentSize(payload.data(), payload.size()) != 2 * count) return wrong("unpacks to another length");
  const std::size_t unpacked = ZSTD_decompress(planes.data(), 2 * count, payload.data(), payload.size());
  if (ZSTD_isError(unpacked) != 0 || unpacked != 2 * count) return wrong("does not unpack");
  for (std::size_t i = 0; i < count; ++i) {
    const auto z =
        static_cast<std::uint16_t>(static_cast<unsigned>(planes[i]) << 8 | static_cast<unsigned>(planes[count + i]));
    out.coefficients[i] =
        static_cast<std::uint16_t>(prediction(out.coefficients, i / kTileSide, i % kTileSide) + unzigzag(z));
  }
  return out;
}

bool TileAssembly::add(const TilePart& part) {
  const bool is_known = has_tile_ && static_cast<std::int32_t>(part.version - tile_.version) <= 0;
  if (is_known) return false;
  if (rows_present_ != 0 && static_cast<std::int32_t>(part.version - growing_.version) < 0) return false;
  if (part.version != growing_.version) rows_present_ = 0;
  growing_.version = part.version;
  std::copy(part.coefficients.begin(), part.coefficients.end(),
            growing_.coefficients.begin() + part.first_row * kTileSide);
  rows_present_ |= part.rows == kTileSide ? 3U : part.first_row == 0 ? 1U : 2U;
  if (rows_present_ != 3U) return false;
  tile_ = growing_;
  has_tile_ = true;
  rows_present_ = 0;
  return true;
}

}  // namespace farfeel::codecs
