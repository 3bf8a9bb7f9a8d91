// An asset made visible: what is stored of it as meshes that can be drawn.
#pragma once

#include <vector>

#include "codecs/asset/asset.h"
#include "master_station/display/picture.h"

namespace farfeel::asset_views {

/// One mesh for each convex surface piece.
[[nodiscard]] std::vector<geometry::TriangleMesh> piece_meshes(const geometry::HapticSurface&);

/// The surface that is felt: every coarse triangle divided until its sides are about `step_m` long, each point moved
/// onto its chart's height field. Coarse where there is no texture.
[[nodiscard]] geometry::TriangleMesh displaced_mesh(const geometry::HapticSurface&, double step_m);

/// Every triangle of a mesh divided likewise.
[[nodiscard]] geometry::TriangleMesh divided(const geometry::TriangleMesh&, double step_m);
/// A texel, or more where the whole surface would be too many triangles to draw.
[[nodiscard]] double picture_step_m(const geometry::HapticSurface&);

/// Each view's bodies in a square of its own, all seen by one camera that sees the box.
[[nodiscard]] tl::expected<master_station::Image, master_station::DisplayError> side_by_side(
    const std::vector<std::vector<master_station::Body>>& views, const geometry::Box&, int height_px);

/// Side by side: the coarse mesh, its pieces in different colours, the felt surface, and what is drawn, if it is in
/// colours.
[[nodiscard]] tl::expected<master_station::Image, master_station::DisplayError> picture(const codecs::Asset&,
                                                                                        int height_px);

}  // namespace farfeel::asset_views
