#include "slave_sim/bake/asset_cache.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>
#include <system_error>
#include <vector>

#include "codecs/text/nearest_word.h"
#include "slave_sim/models/models.h"

namespace farfeel::slave_sim {
namespace {

/// FNV-1a, 64 bits.
std::uint64_t hash_of(std::string_view text) {
  std::uint64_t hash = 0xCBF2'9CE4'8422'2325;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x0000'0100'0000'01B3;
  return hash;
}

std::string file_name(const Model& model, const BakeOptions& options) {
  const contact::Material& m = options.material;
  const std::string shaped_by =
      fmt::format("{} {} {} {} {} {} {} {} {} {} {}", kBakeVersion, model.name, model.full_triangles,
                  options.coarse_triangles, options.texture, options.piece_tolerance_m, options.density_kg_per_m3,
                  m.stiffness_N_per_m, m.damping_Ns_per_m, m.static_friction, m.dynamic_friction);
  return fmt::format("{}-{:016x}.glb", model.name, hash_of(shaped_by));
}

}  // namespace

BakeOptions model_bake_options(const Model& model) {
  BakeOptions options{.coarse_triangles = model.coarse_triangles,
                      .density_kg_per_m3 = model.density_kg_per_m3,
                      .material = model.material};
  if (model.base_mesh != nullptr) options.coarse = model.base_mesh();
  return options;
}

std::filesystem::path asset_cache_folder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0') {
    return std::filesystem::path(cache) / "farfeel";
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    return std::filesystem::path(home) / ".cache" / "farfeel";
  }
  std::error_code ignored;
  return std::filesystem::temp_directory_path(ignored) / "farfeel";
}

std::string no_such_model(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Model& model : models()) names.push_back(model.name);
  const std::string_view near = codecs::nearest_word(name, names);
  return fmt::format("there is no model {}{}; there are {}", name,
                     near.empty() ? "" : fmt::format(", did you mean {}?", near), fmt::join(names, ", "));
}

tl::expected<codecs::Asset, BakeError> cached_model_asset(std::string_view name, const std::filesystem::path& folder,
                                                          const Progress& progress,
                                                          const std::function<void(const std::string&)>& tell) {
  const Model* model = find_model(name);
  if (model == nullptr) return tl::unexpected(BakeError{no_such_model(name)});
  const BakeOptions options = model_bake_options(*model);
  const std::filesystem::path path = folder / file_name(*model, options);
  std::error_code error;
  if (std::filesystem::exists(path, error)) {
    if (auto asset = codecs::read_asset_file(path)) return *std::move(asset);
    // A file that cannot be read is baked again, over it.
  }
  auto baked = bake_asset(std::string(name), model->full_mesh(), options, progress);
  if (!baked) return tl::unexpected(baked.error());
  std::filesystem::create_directories(folder, error);
  const auto written = error ? codecs::AssetResult<void>(tl::unexpected(codecs::AssetError{error.message()}))
                             : codecs::write_asset_file(baked->asset, path);
  if (!written && tell)
    tell(
        fmt::format("model {} is not kept, and baked again at the next start: the cache folder {} cannot be used: {}; "
                    "set XDG_CACHE_HOME to one that can",
                    name, folder.string(), written.error().message));
  const auto bytes = codecs::write_asset(baked->asset);
  if (!bytes) return tl::unexpected(BakeError{bytes.error().message});
  auto asset = codecs::read_asset(*bytes);  // what a later start reads: the drawn mesh is quantised
  if (!asset) return tl::unexpected(BakeError{asset.error().message});
  return *std::move(asset);
}

}  // namespace farfeel::slave_sim
