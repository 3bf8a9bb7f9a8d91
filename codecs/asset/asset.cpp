#include "codecs/asset/asset.h"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <fstream>
#include <system_error>

namespace farfeel::codecs {
namespace {

AssetError failure(const std::filesystem::path& path, std::string_view verb, std::string_view why) {
  return {fmt::format("cannot {} the asset {}: {}", verb, path.string(), why)};
}

bool is_positive_definite(const glm::dmat3& m) {
  const double d2 = m[0][0] * m[1][1] - m[1][0] * m[0][1];
  return m[0][0] > 0 && d2 > 0 && glm::determinant(m) > 0;
}

}  // namespace

std::vector<std::string> faults(const Asset& asset) {
  std::vector<std::string> found = geometry::faults(asset.felt);
  const contact::Material& m = asset.material;
  for (const double value : {m.stiffness_N_per_m, m.damping_Ns_per_m, m.static_friction, m.dynamic_friction}) {
    if (!(value >= 0 && std::isfinite(value))) found.emplace_back("a material property is negative or not finite");
  }
  if (!(m.dynamic_friction <= m.static_friction)) found.emplace_back("dynamic friction is above static friction");
  if (!(asset.mass_kg > 0 && std::isfinite(asset.mass_kg))) found.emplace_back("the mass is not positive");
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double a = asset.inertia_O_kg_m2[i][j], b = asset.inertia_O_kg_m2[j][i];
      if (!std::isfinite(a) || std::abs(a - b) > 1e-9 * (std::abs(a) + std::abs(b))) {
        found.emplace_back("the inertia is not finite and symmetric");
      }
    }
  }
  const HullBreaches& b = asset.breaches;
  if (std::max(b.outside, b.past_middle) > asset.felt.piece_count || !(b.worst_outside_m >= 0) ||
      !(b.worst_past_middle_m >= 0) || !std::isfinite(b.worst_outside_m + b.worst_past_middle_m))
    found.emplace_back("the breaches of the pieces' hulls are absurd");
  if (!asset.visible_colours.empty() && asset.visible_colours.size() != asset.visible.positions_O.size())
    found.emplace_back("the drawn mesh has another number of colours than of vertices");
  if (!spatial::is_finite(asset.p_OM_O)) found.emplace_back("the mesh's origin is not finite");
  if (!is_positive_definite(asset.inertia_O_kg_m2)) found.emplace_back("the inertia is not positive definite");
  if (asset.felt.coarse.triangles.empty()) found.emplace_back("there is nothing to feel: no coarse triangles");
  for (const glm::dvec3& p : asset.felt.coarse.positions_O) {
    if (geometry::rounded_to_float(p) != p) {
      found.emplace_back("a coarse vertex is not exactly representable in float");
      break;
    }
  }
  return found;
}

AssetResult<std::filesystem::path> target_of(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  constexpr int kMostLinks = 40;  // as the kernel has it
  std::error_code error;
  fs::path target = path;
  for (int links = 0; fs::is_symlink(fs::symlink_status(target, error)); ++links) {
    if (links == kMostLinks) return tl::unexpected(failure(path, "write", "its links go round; name a file"));
    const fs::path next = fs::read_symlink(target, error);
    if (error) return tl::unexpected(failure(path, "write", error.message()));
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  const fs::file_status status = fs::status(target, error);
  if (fs::exists(status) && !fs::is_regular_file(status))
    return tl::unexpected(failure(path, "write", "it is a folder, a device or the like; name a file"));
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error))
    return tl::unexpected(failure(path, "write", fmt::format("there is no folder {}; make it first", folder.string())));
  return target;
}

AssetResult<void> write_asset_file(const Asset& asset, const std::filesystem::path& path) {
  const auto bytes = write_asset(asset);
  if (!bytes) return tl::unexpected(bytes.error());
  const auto target = target_of(path);
  if (!target) return tl::unexpected(target.error());
  std::filesystem::path beside = *target;
  beside += ".part";
  const auto given_up = [&](const std::error_code& why) {
    std::error_code ignored;
    std::filesystem::remove(beside, ignored);
    return tl::unexpected(failure(path, "write", why.message()));
  };
  errno = 0;
  std::ofstream out(beside, std::ios::binary | std::ios::trunc);
  if (!out) return tl::unexpected(failure(path, "write", std::generic_category().message(errno)));
  out.write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
  out.close();
  if (!out) return given_up({errno, std::generic_category()});
  std::error_code error;
  std::filesystem::rename(beside, *target, error);
  if (error) return given_up(error);
  return {};
}

AssetResult<Asset> read_asset_file(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) return tl::unexpected(failure(path, "read", error.message()));
  constexpr std::uintmax_t kMostBytes = 1ULL << 31;
  if (size > kMostBytes) return tl::unexpected(failure(path, "read", "it is larger than 2 GiB"));
  std::vector<std::byte> bytes(size);
  std::ifstream in(path, std::ios::binary);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!in) return tl::unexpected(failure(path, "read", "the file cannot be read"));
  auto asset = read_asset(bytes);
  if (!asset) return tl::unexpected(failure(path, "read", asset.error().message));
  return asset;
}

}  // namespace farfeel::codecs
