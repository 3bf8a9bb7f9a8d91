#include "deploy/asset/deviation_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "deploy/asset/asset_views.h"
#include "slave_sim/bake/full_surface.h"

namespace farfeel::asset_views {
namespace {

using geometry::TriangleMesh;

struct Colour {
  const char* name;
  glm::vec3 sRGB;
};
/// From dark to light, as everybody tells them apart; what is off worst is red.
constexpr std::array<Colour, kBands> kColours{{{"violet", {0.27F, 0.15F, 0.45F}},
                                               {"blue", {0.20F, 0.38F, 0.60F}},
                                               {"teal", {0.13F, 0.57F, 0.55F}},
                                               {"green", {0.45F, 0.76F, 0.36F}},
                                               {"yellow", {0.96F, 0.88F, 0.20F}},
                                               {"red", {0.85F, 0.15F, 0.12F}}}};

constexpr Colour kMadeUp{"pale", {0.88F, 0.86F, 0.82F}};

glm::dvec3 middle_of(const TriangleMesh& mesh, const geometry::Triangle& t) {
  return (mesh.positions_O[t[0]] + mesh.positions_O[t[1]] + mesh.positions_O[t[2]]) / 3.0;
}

double rms_m(const TriangleMesh& mesh, const slave_sim::FullSurface& other) {
  double squares = 0;
  for (const geometry::Triangle& t : mesh.triangles) {
    const double distance_m = other.distance_m(middle_of(mesh, t));
    squares += distance_m * distance_m;
  }
  return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, mesh.triangles.size())));
}

/// 1, 2 or 5 times a power of ten, just below.
double rounded_down(double length_m) {
  const double power = std::pow(10, std::floor(std::log10(length_m)));
  return length_m >= 5 * power ? 5 * power : length_m >= 2 * power ? 2 * power : power;
}

std::vector<master_station::Body> bodies_of(const Bands& bands) {
  std::vector<master_station::Body> bodies;
  for (std::size_t k = 0; k < kBands; ++k) {
    if (!bands[k].triangles.empty()) bodies.push_back({&bands[k], {}, kColours[k].sRGB});
  }
  return bodies;
}

}  // namespace

Bands by_distance(const TriangleMesh& mesh, const TriangleMesh& other, double first_m) {
  const slave_sim::FullSurface surface(other);
  Bands bands;
  for (TriangleMesh& band : bands) band.positions_O = mesh.positions_O;
  for (const geometry::Triangle& t : mesh.triangles) {
    const double doublings = std::log2(std::max(surface.distance_m(middle_of(mesh, t)) / first_m, 0.5));
    const auto band = static_cast<std::size_t>(std::clamp(std::ceil(doublings), 0.0, kBands - 1.0));
    bands[band].triangles.push_back(t);
  }
  return bands;
}

Parted parted(const TriangleMesh& mesh, const TriangleMesh& other) {
  constexpr double kOn = 1e-6;  // of the size
  const double most_m = kOn * glm::length(geometry::bounding_box(mesh).size());
  const slave_sim::FullSurface surface(other);
  Parted out{{mesh.positions_O, {}}, {mesh.positions_O, {}}};
  for (const geometry::Triangle& t : mesh.triangles)
    (surface.distance_m(middle_of(mesh, t)) <= most_m ? out.on : out.off).triangles.push_back(t);
  return out;
}

tl::expected<DeviationPicture, master_station::DisplayError> deviation_picture(const codecs::Asset& asset,
                                                                               const TriangleMesh& given_M,
                                                                               const TriangleMesh& file_M,
                                                                               int height_px) {
  constexpr double kLeast_m = 1e-7;
  constexpr double kCoarser = 2;  // colours need no single texels, and each triangle's distance takes its time
  const double step_m = kCoarser * picture_step_m(asset.felt);
  const TriangleMesh felt = displaced_mesh(asset.felt, step_m);
  const auto placed = [&](TriangleMesh mesh) {
    for (glm::dvec3& p : mesh.positions_O) p += asset.p_OM_O;
    return divided(mesh, step_m);
  };
  const TriangleMesh given = placed(given_M);
  const Parted parts = parted(given_M, file_M);
  const TriangleMesh own = placed(parts.on), made_up = placed(parts.off);
  const double first_m = rounded_down(std::max(kLeast_m, 0.5 * rms_m(felt, slave_sim::FullSurface(given))));
  const Bands felt_bands = by_distance(felt, given, first_m), given_bands = by_distance(own, felt, first_m);
  std::vector<master_station::Body> given_bodies = bodies_of(given_bands);
  if (!made_up.triangles.empty()) given_bodies.push_back({&made_up, {}, kMadeUp.sRGB});
  auto image = side_by_side({bodies_of(felt_bands), given_bodies}, geometry::bounding_box(given), height_px);
  if (!image) return tl::unexpected(image.error());
  std::string legend;
  for (std::size_t k = 0; k + 1 < kBands; ++k)
    legend += fmt::format("{} within {:g} um, ", kColours[k].name, 1e6 * first_m * std::exp2(k));
  legend += fmt::format("{} beyond", kColours.back().name);
  if (!made_up.triangles.empty()) legend += fmt::format("; {}: made up by the bake, not in the file", kMadeUp.name);
  return DeviationPicture{*std::move(image), legend};
}

}  // namespace farfeel::asset_views
