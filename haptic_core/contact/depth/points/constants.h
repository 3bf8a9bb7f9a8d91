// Every tuned number of this room, with its unit and why it is as large as it is.
#pragma once

#include <cstddef>
#include <cstdint>

namespace farfeel::contact {

// How much of a contact is felt as points (point_fallback.cpp).
/// Stacked pieces that both come nearer to the other object than this begin to be felt as points, and are so altogether
/// half that far: layers that cannot touch at once are told apart by height fields.
inline constexpr double kLayersFrom_m = 0.4e-3, kLayersWithin_m = 0.2e-3;
/// Height fields that are shallower than the coarse pieces by so much are not believed at all.
inline constexpr double kFloorWithin_m = 0.2e-3;
inline constexpr double kOverlapWithin_m = 0.1e-3;  ///< of coarse pieces that have begun to overlap
/// Of the share's part of the gradient: no steeper than surfaces are. More is energy that no force tells of.
inline constexpr double kSteepestShare = 1;

// How deep points are (point_depth.cpp).
/// A point that weighs less than exp(-12) = 6e-6 of all together is left out.
inline constexpr double kPointTailWidths = 12;
/// Cosine between the way against T's normal at a point and the patch's direction: what leads the other way is another
/// contact's. S's normal would do as well, but changes as points pass from facet to facet.
inline constexpr double kPointUnaligned = 0.05, kPointAligned = 0.35;
/// From pose to pose a depth changes by no more than the way times this, where S's relief is no steeper than 37
/// degrees.
inline constexpr double kSteepestRelief = 1.25;
/// After so much of a way a part is bounded anew. And a way after which nothing is known.
inline constexpr double kAnew_m = 0.15e-3, kAnywhere_m = 1e3;
/// So far a leaf goes, and T turns, on the facets that were sifted for it.
inline constexpr double kSiftedWay_m = 0.4e-3, kSiftedTurn = 0.2;
inline constexpr std::uint32_t kLeafLevels = 4;  ///< 2^4 points: what sixteen lanes look at together
/// Points that are farther above S than this push nobody, nor will they soon.
inline constexpr double kAbove_m = 1e-3;

// Which facets a point is compared with (nearest_facets.cpp).
inline constexpr std::size_t kFew = 20;         ///< triangles that are not worth dividing a cube for
inline constexpr double kLeastSide_m = 0.3e-3;  ///< of a cube: some texels
inline constexpr std::size_t kMostCells = 1u << 14, kMostFacets = 1u << 21;  ///< some 10 MB for a surface
inline constexpr std::uint32_t kDeepestCube = 20;                            ///< halvings: a metre becomes a micrometre
/// How much farther than the nearest place those are that are asked for, and how far they all are.
inline constexpr double kFarther = 2, kAll_m = 0.15e-3;

// Which pieces lie above each other (stacked_pieces.cpp).
inline constexpr double kFacing = 0.5;           ///< cosine: what a height field along one direction can hold at once
inline constexpr double kLeastApart_m = 0.3e-3;  ///< nearer layers are one surface whose pieces meet

// A surface as points (surface_points.cpp).
/// Longest side of what counts as a point, about, where the whole surface takes no more points than that.
inline constexpr double kPoint_m = 0.35e-3;
inline constexpr std::size_t kMostPoints = 1u << 17;  ///< 3 MB
inline constexpr std::uint32_t kMostLevels = 16;      ///< halvings of a triangle

}  // namespace farfeel::contact
