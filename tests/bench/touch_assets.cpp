// Beside each kept asset lies a small text file with what its file does not say: how far it is from the original.
#include "tests/bench/touch_assets.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <fstream>
#include <numbers>

#include "slave_sim/bake/asset_cache.h"

namespace farfeel::bench {
namespace {

using geometry::TriangleMesh;

constexpr double kNeedleDiameter_mm = 1, kNeedleLength_mm = 40;

/// FNV-1a, 64 bits, of whatever shapes a bake.
class Hash {
 public:
  void add(const void* bytes, std::size_t count) {
    const auto* at = static_cast<const unsigned char*>(bytes);
    for (std::size_t i = 0; i < count; ++i) hash_ = (hash_ ^ at[i]) * 0x0000'0100'0000'01B3;
  }
  template <typename T>
  void add(const T& value) {
    add(&value, sizeof(T));
  }
  void add(const TriangleMesh& mesh) {
    add(mesh.positions_O.data(), mesh.positions_O.size() * sizeof(glm::dvec3));
    add(mesh.triangles.data(), mesh.triangles.size() * sizeof(geometry::Triangle));
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xCBF2'9CE4'8422'2325;
};

std::filesystem::path path_of(const std::string& name, const TouchMesh& given) {
  Hash hash;
  const slave_sim::BakeOptions& o = given.options;
  hash.add(slave_sim::kBakeVersion);
  hash.add(given.mesh);
  hash.add(o.coarse_triangles), hash.add(o.texture), hash.add(o.piece_tolerance_m), hash.add(o.density_kg_per_m3);
  if (o.coarse) hash.add(*o.coarse);
  return slave_sim::asset_cache_folder() / fmt::format("touch-{}-{:016x}.glb", name, hash.value());
}

TriangleMesh moved(TriangleMesh mesh, const glm::dvec3& by) {
  for (glm::dvec3& p : mesh.positions_O) p += by;
  return mesh;
}

std::optional<BakedMesh> read_kept(const std::filesystem::path& path) {
  std::ifstream said(path.string() + ".txt");
  BakedMesh kept;
  if (!(said >> kept.p999_m >> kept.coarse_triangles >> kept.texture)) return std::nullopt;
  auto asset = codecs::read_asset_file(path);
  if (!asset) return std::nullopt;
  kept.asset = *std::move(asset);
  return kept;
}

/// Twice the triangles, and as many texels for each.
void make_finer(slave_sim::BakeOptions& options) {
  options.coarse_triangles *= 2;
  options.texture = static_cast<std::uint32_t>(std::lround(std::numbers::sqrt2 * options.texture));
}

double p999_m(const slave_sim::BakeReport& report) {
  return std::max(report.full_to_felt.p999_m, report.felt_to_full.p999_m);
}

}  // namespace

tl::expected<BakedMesh, std::string> kept_asset(const std::string& name, const TouchMesh& given, bool is_anew) {
  const std::filesystem::path path = path_of(name, given);
  if (!is_anew) {
    if (auto kept = read_kept(path)) {
      kept->original_O = moved(given.mesh, kept->asset.p_OM_O);
      return *std::move(kept);
    }
  }
  slave_sim::BakeOptions options = given.options;
  auto baked = slave_sim::bake_asset(name, given.mesh, options);
  for (int finer = 0; baked && !options.coarse && p999_m(baked->report) > kMostDeviation_m && finer < kFinerBakes;
       ++finer) {
    make_finer(options);
    baked = slave_sim::bake_asset(name, given.mesh, options);
  }
  if (!baked) return tl::unexpected(baked.error().message);
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  const auto written = codecs::write_asset_file(baked->asset, path);
  if (!written) return tl::unexpected(written.error().message);
  std::ofstream(path.string() + ".txt") << fmt::format("{} {} {}\n", p999_m(baked->report), options.coarse_triangles,
                                                       options.texture);
  auto kept = read_kept(path);  // what the next run will get
  if (!kept) return tl::unexpected(fmt::format("the asset cannot be read back from {}", path.string()));
  kept->original_O = moved(given.mesh, kept->asset.p_OM_O);
  return *std::move(kept);
}

TouchSubject::TouchSubject(BakedMesh&& made) : baked(std::move(made)), felt(baked.asset.felt), truth(baked.original_O) {
  double area_m2 = 0;
  for (const geometry::Triangle& t : baked.original_O.triangles) {
    const auto& p = baked.original_O.positions_O;
    area_m2 += 0.5 * glm::length(glm::cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]));
    area_up_to_m2.push_back(area_m2);
  }
}

TouchTool::TouchTool(std::string tool_name, const RoundTool& round, BakedMesh&& made)
    : name(std::move(tool_name)), shape(round), baked(std::move(made)), felt(baked.asset.felt) {}

const std::vector<std::string>& touch_tool_names() {
  static const std::vector<std::string> names{"ball-0.5", "ball-3", "ball-10", "needle"};
  return names;
}

std::unique_ptr<TouchTool> touch_tool(const std::string& name, bool is_anew) {
  TouchMesh given;
  RoundTool shape;
  if (name == "needle") {
    given.mesh = capsule_mesh(kNeedleDiameter_mm, kNeedleLength_mm);
    shape = {0.5e-3 * kNeedleDiameter_mm, 0.5e-3 * (kNeedleLength_mm - kNeedleDiameter_mm)};
  } else {
    double diameter_mm = 0;
    if (!name.starts_with("ball-") || !CLI::detail::lexical_cast(name.substr(5), diameter_mm) ||
        !(diameter_mm >= 0.1 && diameter_mm <= 100)) {
      throw CLI::ValidationError("--tool", fmt::format("{} is neither needle nor ball- and a diameter in mm", name));
    }
    given.mesh = ball_mesh(diameter_mm);
    given.options.coarse = ball_base(diameter_mm);
    given.options.coarse_triangles = static_cast<std::uint32_t>(given.options.coarse->triangles.size());
    shape = {0.5e-3 * diameter_mm, 0};
  }
  auto baked = kept_asset(name, given, is_anew);
  if (!baked) throw CLI::RuntimeError(fmt::format("{}: {}", name, baked.error()), 1);
  return std::make_unique<TouchTool>(name, shape, *std::move(baked));
}

}  // namespace farfeel::bench
