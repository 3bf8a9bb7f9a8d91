// Replays a recorded session and says where it goes another way than it did then.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/recording/felt_asset.h"
#include "codecs/recording/recording.h"

namespace farfeel::replay {

/// Holds the simd back end to AVX2, with which every machine is to replay. Fails where it is not to be had.
[[nodiscard]] tl::expected<void, std::string> hold_to_avx2();
/// Compiler, C library and kernels of this program, and OpenGL's driver where the recording needs one: with other ones
/// bits may differ.
[[nodiscard]] std::string made_here(const codecs::Recording&);

struct ReplayWish {
  double within = 0;          ///< see codecs::first_difference(); 0: to the last bit
  bool keeps_values = false;  ///< in the recording anew
};
struct Replayed {
  std::string difference;  ///< the first one of each stream; empty: none
  std::size_t ticks = 0, answers = 0;
  codecs::Recording anew;  ///< the same inputs, with what came out now
};
/// Fails where the recording is not to be replayed: settings that this program does not know, an outline that is
/// none.
[[nodiscard]] tl::expected<Replayed, std::string> replay(const codecs::Recording&, const codecs::FeltAsset&,
                                                         const ReplayWish&);

/// Where the asset of that hash lies beside a recording.
[[nodiscard]] std::filesystem::path asset_path(const std::filesystem::path& recording, std::uint64_t hash);
[[nodiscard]] tl::expected<std::vector<std::byte>, std::string> bytes_of(const std::filesystem::path&);
[[nodiscard]] tl::expected<void, std::string> write_bytes(const std::filesystem::path&, std::span<const std::byte>);
/// The recording's only asset, whose hash is looked at.
[[nodiscard]] tl::expected<codecs::FeltAsset, std::string> asset_of(const codecs::Recording&,
                                                                    const std::filesystem::path& recording);

}  // namespace farfeel::replay
