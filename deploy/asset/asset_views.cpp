#include "deploy/asset/asset_views.h"

#include <algorithm>
#include <cmath>

namespace farfeel::asset_views {
namespace {

using geometry::HapticSurface;
using geometry::TriangleMesh;
using master_station::Body;
using master_station::Camera;
using master_station::DisplayError;
using master_station::Image;
using master_station::Still;

constexpr glm::vec3 kSteel{0.62F, 0.66F, 0.71F}, kBrass{0.86F, 0.66F, 0.28F};
constexpr double kMostTriangles = 1.5e6;  // of the felt surface, which bounds memory and drawing time

double area_m2(const TriangleMesh& mesh) {
  double twice = 0;
  for (const geometry::Triangle& t : mesh.triangles) {
    const glm::dvec3& a = mesh.positions_O[t[0]];
    twice += glm::length(glm::cross(mesh.positions_O[t[1]] - a, mesh.positions_O[t[2]] - a));
  }
  return 0.5 * twice;
}

glm::dvec3 felt_point(const HapticSurface& surface, std::uint32_t triangle, const glm::dvec3& p_O) {
  const std::uint32_t index = surface.triangle_chart[triangle];
  if (index == geometry::kNoChart) return p_O;
  const geometry::Chart& chart = surface.charts[index];
  const glm::dvec3 p_H = spatial::rotate_back(chart.X_OH, p_O - chart.X_OH.p);
  return spatial::transform_point(chart.X_OH,
                                  {p_H.x, p_H.y, geometry::sample_height(surface, chart, p_H.x, p_H.y).h_m});
}

/// Neighbouring pieces get hues far apart: the golden ratio's multiples fill the circle evenly.
glm::vec3 colour_of(std::size_t piece) {
  const double hue = std::fmod(0.618034 * static_cast<double>(piece), 1.0);
  const auto channel = [&](double shift) {
    return static_cast<float>(0.55 + 0.3 * std::cos(2 * 3.14159265 * (hue + shift)));
  };
  return {channel(0), channel(1.0 / 3), channel(2.0 / 3)};
}

tl::expected<Image, DisplayError> drawn(const std::vector<Body>& bodies, const Camera& camera, int width, int height) {
  auto images = master_station::draw(Still{.bodies = bodies, .arrows = {}}, {camera}, width, height);
  if (!images) return tl::unexpected(images.error());
  return std::move(images->front());
}

/// Every triangle divided until its sides are about step_m long, each point moved where place(triangle, p_O) says.
/// A sliver's are longer: its area counts, so that there are never more than some times as many triangles as step_m^2
/// goes into the area.
template <typename Place>
TriangleMesh divided_and_placed(const TriangleMesh& mesh, double step_m, const Place& place) {
  TriangleMesh out;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const glm::dvec3 p = mesh.positions_O[a], to_b = mesh.positions_O[b] - p, to_c = mesh.positions_O[c] - p;
    const auto point = [&](double u, double v) { return place(i, p + u * to_b + v * to_c); };
    const double longest_m = std::max({glm::length(to_b), glm::length(to_c), glm::length(to_c - to_b)});
    const double by_area = std::sqrt(4 * glm::length(glm::cross(to_b, to_c)));  // of an even triangle twice its side
    const auto n = static_cast<std::uint32_t>(std::max(1.0, std::ceil(std::min(longest_m, by_area) / step_m)));
    // Row v holds n - v + 1 points; the first of them stands at first + v (n + 1) - v (v - 1) / 2.
    const auto first = static_cast<std::uint32_t>(out.positions_O.size());
    const auto at = [&](std::uint32_t u, std::uint32_t v) { return first + v * (n + 1) - (v * v - v) / 2 + u; };
    for (std::uint32_t v = 0; v <= n; ++v) {
      for (std::uint32_t u = 0; u + v <= n; ++u) {
        out.positions_O.push_back(point(u / static_cast<double>(n), v / static_cast<double>(n)));
        if (u + v == n) continue;
        out.triangles.push_back({at(u, v), at(u + 1, v), at(u, v + 1)});
        if (u + v + 1 < n) out.triangles.push_back({at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)});
      }
    }
  }
  return out;
}

void paste(const Image& from, int column, Image& to) {
  for (int row = 0; row < from.height; ++row) {
    std::copy_n(from.rgba.begin() + 4L * row * from.width, 4L * from.width,
                to.rgba.begin() + 4L * (static_cast<long>(row) * to.width + column));
  }
}

}  // namespace

std::vector<TriangleMesh> piece_meshes(const HapticSurface& surface) {
  std::vector<TriangleMesh> pieces(surface.piece_count);
  for (std::size_t i = 0; i < surface.coarse.triangles.size(); ++i) {
    TriangleMesh& piece = pieces[surface.triangle_piece[i]];
    const auto first = static_cast<std::uint32_t>(piece.positions_O.size());
    for (const std::uint32_t v : surface.coarse.triangles[i])
      piece.positions_O.push_back(surface.coarse.positions_O[v]);
    piece.triangles.push_back({first, first + 1, first + 2});
  }
  return pieces;
}

TriangleMesh displaced_mesh(const HapticSurface& surface, double step_m) {
  return divided_and_placed(surface.coarse, step_m, [&](std::uint32_t triangle, const glm::dvec3& p_O) {
    return felt_point(surface, triangle, p_O);
  });
}

TriangleMesh divided(const TriangleMesh& mesh, double step_m) {
  return divided_and_placed(mesh, step_m, [](std::uint32_t, const glm::dvec3& p_O) { return p_O; });
}

double picture_step_m(const HapticSurface& surface) {
  double step_m = std::sqrt(area_m2(surface.coarse) * 2 / kMostTriangles);
  for (const geometry::Chart& chart : surface.charts) step_m = std::max(step_m, chart.texel_m);
  return step_m;
}

tl::expected<Image, DisplayError> side_by_side(const std::vector<std::vector<Body>>& views, const geometry::Box& box,
                                               int height_px) {
  const int width_px = height_px, count = static_cast<int>(views.size());
  const Camera camera = master_station::camera_for(box, 1);
  Image all{count * width_px, height_px, std::vector<std::uint8_t>(4UL * count * width_px * height_px)};
  for (int i = 0; i < count; ++i) {
    const auto image = drawn(views[i], camera, width_px, height_px);
    if (!image) return tl::unexpected(image.error());
    paste(*image, i * width_px, all);
  }
  return all;
}

tl::expected<Image, DisplayError> picture(const codecs::Asset& asset, int height_px) {
  const HapticSurface& surface = asset.felt;
  const std::vector<TriangleMesh> pieces = piece_meshes(surface);
  const TriangleMesh felt = displaced_mesh(surface, picture_step_m(surface));

  const std::vector<Body> coarse_bodies{{&surface.coarse, {}, kSteel}}, felt_bodies{{&felt, {}, kBrass}};
  std::vector<Body> piece_bodies;
  for (std::size_t i = 0; i < pieces.size(); ++i) piece_bodies.push_back({&pieces[i], {}, colour_of(i)});

  std::vector<std::vector<Body>> views{coarse_bodies, piece_bodies, felt_bodies};
  if (!asset.visible_colours.empty()) views.push_back({{&asset.visible, {}, kSteel, asset.visible_colours}});
  return side_by_side(views, geometry::bounding_box(surface.coarse), height_px);
}

}  // namespace farfeel::asset_views
