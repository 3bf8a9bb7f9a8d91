#include "slave_sim/edits/stamp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/models/height_plate.h"

namespace farfeel::slave_sim {
namespace {

using geometry::HapticSurface;

constexpr double kRoom_m = 2e-3;

HapticSurface plate(double ridges_m = 0.3e-3) {
  HapticSurface surface = ridged_plate(3e-3, ridges_m, {.size_m = {0.04, 0.03, 0.01}});
  make_room(surface, kRoom_m);
  return surface;
}

double height_m(const HapticSurface& surface, double x_m, double y_m) {
  const geometry::Chart& chart = surface.charts[0];
  const glm::dvec3 p_H = spatial::transform_point(spatial::inverse(chart.X_OH), {x_m, y_m, 0});
  return spatial::transform_point(chart.X_OH, {p_H.x, p_H.y, sample_height(surface, chart, p_H.x, p_H.y).h_m}).z;
}

/// Takes the edits over as whoever feels the surface does.
void take(HapticSurface& surface, const std::vector<SurfaceEdit>& edits) {
  for (const SurfaceEdit& edit : edits) {
    ASSERT_GT(edit.tile.version, surface.tiles[edit.where.tile].version);
    surface.tiles[edit.where.tile] = edit.tile;
  }
}

TEST(Stamp, RoomChangesNoHeight) {
  HapticSurface before = ridged_plate(3e-3, 0.3e-3, {.size_m = {0.04, 0.03, 0.01}}), after = before;
  make_room(after, kRoom_m);
  EXPECT_LE(after.scale.offset_m, before.scale.offset_m - kRoom_m + 1e-9);
  double off_m = 0;
  for (double x_m = -0.019; x_m < 0.019; x_m += 0.7e-3)
    off_m = std::max(off_m, std::abs(height_m(before, x_m, 0.4 * x_m) - height_m(after, x_m, 0.4 * x_m)));
  EXPECT_LE(off_m, after.scale.scale_m);
  EXPECT_LT(after.scale.scale_m, 50e-9);
}

/// What is left is the lower of the surface and the ball, as the formulas of both say: no part of the stamp has a say.
TEST(Stamp, LeavesTheSurfaceLessTheBall) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<> at(-0.008, 0.008), radius(2e-3, 8e-3), share(0.02, 0.2);
  for (int i = 0; i < 20; ++i) {
    HapticSurface surface = plate(0);
    Stamp stamp{{at(random), at(random), 0}, radius(random), 0};
    stamp.depth_m = std::min(1.5e-3, share(random) * stamp.radius_m);
    const HapticSurface before = surface;
    const auto edits = stamped(surface, 1, stamp);
    ASSERT_TRUE(edits) << edits.error();
    take(surface, *edits);
    const double texel_m = surface.charts[0].texel_m;
    const double off_m =
        0.4 * texel_m * texel_m / stamp.radius_m + surface.scale.scale_m;  // twice a quarter at the rim
    const double rim_m = std::sqrt(stamp.radius_m * stamp.radius_m -
                                   (stamp.radius_m - stamp.depth_m) * (stamp.radius_m - stamp.depth_m));
    for (double dx_m = -1.2 * rim_m; dx_m <= 1.2 * rim_m; dx_m += 0.37 * texel_m) {
      for (const double dy_m : {-0.5 * rim_m, 0.0, 0.31 * rim_m}) {
        const double far_m = std::hypot(dx_m, dy_m);
        if (std::abs(far_m - rim_m) < 2 * texel_m) continue;  // rounded there
        const double x_m = stamp.p_O.x + dx_m, y_m = stamp.p_O.y + dy_m;
        const double dent_m =
            stamp.radius_m - stamp.depth_m - std::sqrt(std::max(0.0, stamp.radius_m * stamp.radius_m - far_m * far_m));
        const double wanted_m = far_m < rim_m ? dent_m : height_m(before, x_m, y_m);
        ASSERT_NEAR(height_m(surface, x_m, y_m), wanted_m, off_m) << i << " " << dx_m << " " << dy_m;
      }
    }
  }
}

TEST(Stamp, OnTextureOnlyTakesAway) {
  HapticSurface surface = plate();
  const HapticSurface before = surface;
  take(surface, stamped(surface, 1, {{1e-3, -2e-3, 0}, 5e-3, 0.4e-3}).value());
  double deepest_m = 0;
  for (double x_m = -5e-3; x_m <= 7e-3; x_m += 0.05e-3) {
    const double lower_m = height_m(before, x_m, -2e-3) - height_m(surface, x_m, -2e-3);
    EXPECT_GE(lower_m, -2e-6) << "the spline's own smoothing at most";
    deepest_m = std::max(deepest_m, lower_m);
  }
  EXPECT_GT(deepest_m, 0.3e-3);
  EXPECT_LT(deepest_m, 0.75e-3) << "from a valley a crest is lower by the ridges' height more";
}

TEST(Stamp, AgainAtTheSamePlaceOfAPlaneGoesNoDeeperThanAsked) {
  HapticSurface surface = plate(0);
  const Stamp stamp{{0, 0, 0}, 5e-3, 0.4e-3};
  take(surface, stamped(surface, 1, stamp).value());
  // The place is the dent's ground now: the second is measured from there.
  take(surface, stamped(surface, 1, stamp).value());
  EXPECT_NEAR(height_m(surface, 0, 0), -0.8e-3, 5e-6);
}

/// Tiles repeat their neighbours' two columns: whoever takes only one of them over must find the same there.
TEST(Stamp, NeighboursAgreeWhereTheyRepeatEachOther) {
  HapticSurface surface = plate();
  take(surface, stamped(surface, 1, {{0.2e-3, 0.1e-3, 0}, 8e-3, 1e-3}).value());
  const geometry::Chart& chart = surface.charts[0];
  ASSERT_GT(chart.tiles_across(), 2u);
  const auto tile = [&](std::uint32_t across, std::uint32_t down) -> const geometry::HeightTile& {
    return surface.tiles[chart.first_tile + down * chart.tiles_across() + across];
  };
  for (std::uint32_t down = 0; down < chart.tiles_down(); ++down) {
    for (std::uint32_t across = 0; across + 1 < chart.tiles_across(); ++across) {
      for (std::uint32_t row = 0; row < geometry::kTileSide; ++row) {
        for (const std::uint32_t column : {0u, 1u})
          ASSERT_EQ(tile(across, down).at(geometry::kTileTexels + column, row), tile(across + 1, down).at(column, row));
      }
    }
  }
  for (std::uint32_t down = 0; down + 1 < chart.tiles_down(); ++down) {
    for (std::uint32_t across = 0; across < chart.tiles_across(); ++across) {
      for (std::uint32_t column = 0; column < geometry::kTileSide; ++column) {
        for (const std::uint32_t row : {0u, 1u})
          ASSERT_EQ(tile(across, down).at(column, geometry::kTileTexels + row), tile(across, down + 1).at(column, row));
      }
    }
  }
}

TEST(Stamp, IsRefusedWithWhatIsPossible) {
  const HapticSurface surface = plate(0);
  const auto why = [&](const Stamp& stamp, const HapticSurface& of) {
    const auto edits = stamped(of, 1, stamp);
    return edits ? std::string("(made)") : edits.error();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(why({{0, 0, 0}, 5e-3, 6e-3}, surface).find("up to the radius"), std::string::npos);
  EXPECT_NE(why({{0, 0, 0}, 5e-3, nan}, surface).find("up to the radius"), std::string::npos);
  EXPECT_NE(why({{nan, 0, 0}, 5e-3, 1e-3}, surface).find("up to the radius"), std::string::npos);
  EXPECT_NE(why({{0, 0, -0.01}, 5e-3, 1e-3}, surface).find("no texture"), std::string::npos) << "its lower face";
  EXPECT_NE(why({{0, 0, 0.0431}, 5e-3, 1e-3}, surface).find("the nearest is 43.1 mm from the place"),
            std::string::npos);
  EXPECT_EQ(why({{0, 0, 4.9e-3}, 5e-3, 1e-3}, surface), "(made)") << "what is meant may be a little off";
  // Beyond the room, it says what the room is.
  EXPECT_NE(why({{0, 0, 0}, 5e-3, 3e-3}, surface).find("2.00"), std::string::npos)
      << why({{0, 0, 0}, 5e-3, 3e-3}, surface);
  HapticSurface thin = surface;
  thin.piece_thickness_m.assign(thin.piece_count, 1e-3);
  EXPECT_NE(why({{0, 0, 0}, 5e-3, 0.6e-3}, thin).find("0.500 mm is possible"), std::string::npos);
  EXPECT_EQ(why({{0, 0, 0}, 5e-3, 0.5e-3}, thin), "(made)");
}

/// The contact service feels the dent: a ball that was pressed in is not, until it is as deep as the dent.
TEST(Stamp, IsFelt) {
  HapticSurface table = plate(0);
  HapticSurface tool = height_plate(
      [](double x_m, double y_m) { return -0.5 * (x_m * x_m + y_m * y_m) / 3e-3; },  // near its top a ball of 3 mm
      {.size_m = {0.004, 0.004, 0.004}, .texel_m = 0.5e-4});
  penetration::FeltSurface felt(table), felt_tool(tool);
  const contact_service::TouchableObject object{.felt = &table, .material = {}, .X_WO = {}, .prepared = &felt};
  contact_service::ContactService service({&object, 1},
                                          {.felt = &tool, .material = {}, .X_WO = {}, .prepared = &felt_tool}, {});
  const auto depth_m = [&](double press_m, double x_m) {
    service.restart();
    const contact::ContactSet& set = service.answer({.X_WT = {{0, 1, 0, 0}, {x_m, 0, -press_m}}, .V_WT_W = {}});
    double deepest_m = -1;
    for (std::uint32_t i = 0; i < set.count; ++i) deepest_m = std::max(deepest_m, set.contacts[i].depth_m);
    return deepest_m;
  };
  EXPECT_NEAR(depth_m(0.2e-3, 0), 0.2e-3, 10e-6);
  const auto edits = stamped(table, 1, {{0, 0, 0}, 6e-3, 0.5e-3});
  ASSERT_TRUE(edits) << edits.error();
  for (const SurfaceEdit& edit : *edits) {
    table.tiles[edit.where.tile] = edit.tile;
    felt.take_tile(edit.where.tile);
  }
  EXPECT_LT(depth_m(0.2e-3, 0), -0.25e-3) << "0.3 mm clear of the dent's ground";
  EXPECT_NEAR(depth_m(0.7e-3, 0), 0.2e-3, 20e-6) << "softened over a wider patch, for the dent bends along";
  EXPECT_NEAR(depth_m(0.2e-3, 8e-3), 0.2e-3, 10e-6) << "beside it";
}

}  // namespace
}  // namespace farfeel::slave_sim
