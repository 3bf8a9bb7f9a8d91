// Benchmark models baked once and kept in a cache folder.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "slave_sim/bake/bake.h"
#include "slave_sim/models/models.h"

namespace farfeel::slave_sim {

/// $XDG_CACHE_HOME/farfeel, else $HOME/.cache/farfeel, else a folder under the system's temporary one.
[[nodiscard]] std::filesystem::path asset_cache_folder();

/// Grows whenever a generator, the bake or the file format gives something else for the same request.
inline constexpr int kBakeVersion = 13;

/// How a benchmark model is baked unless somebody says otherwise.
[[nodiscard]] BakeOptions model_bake_options(const Model&);

/// With the nearest name that there is, and all of them.
[[nodiscard]] std::string no_such_model(std::string_view name);

/// The baked benchmark model of that name (models.h), read from the cache, or baked and put there first: a minute at
/// most. A file's name carries a hash of everything that shaped it, so a new version of the bake never reads an old
/// one. Where the cache cannot be written the model is baked at every start: tell says so, and what to do.
[[nodiscard]] tl::expected<codecs::Asset, BakeError> cached_model_asset(
    std::string_view name, const std::filesystem::path& folder = asset_cache_folder(), const Progress& = {},
    const std::function<void(const std::string&)>& tell = {});

}  // namespace farfeel::slave_sim
