#include "codecs/asset/asset.h"

#include <fmt/format.h>

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

AssetResult<void> write_asset_file(const Asset& asset, const std::filesystem::path& path) {
  const auto bytes = write_asset(asset);
  if (!bytes) return tl::unexpected(bytes.error());
  std::filesystem::path beside = path;
  beside += ".part";
  {
    std::ofstream out(beside, std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
    out.close();
    if (!out)
      return tl::unexpected(failure(path, "write", "the file cannot be written; is the folder there and writable?"));
  }
  std::error_code error;
  std::filesystem::rename(beside, path, error);
  if (error) return tl::unexpected(failure(path, "write", error.message()));
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
