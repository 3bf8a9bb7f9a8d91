// Every tuned number of this room, with its unit and why it is as large as it is.
#pragma once

#include <cstdint>

namespace farfeel::contact {

// A contact's frame, and whether its depth is believed (contact_frame.cpp).
/// Of C about the direction, against the axes that the direction alone would give. Depths are summed over nodes on C's
/// lattice. S's axes are often those of its texture, and a lattice along a periodic texture meets the same phases again
/// and again, so that its nodes' errors do not make up for each other. This angle is far from those of squares, of
/// triangles and of simple slopes: its tangent is the golden ratio less one.
inline constexpr double kOffAxes_rad = 0.55357435889704525;
/// Felt surfaces lie within 60 degrees of facing along the direction, so no true slope is larger than 1 / cos 60 and a
/// little for texture. What is steeper comes from a sum that hardly any weight is left in.
inline constexpr double kSteepestCredible = 4;

// What is searched, and where (depth_stage.cpp).
/// The window keeps this many soft widths of overlap below the peak; weights beyond are under 1e-6.
inline constexpr double kTailWidths = 14;
inline constexpr double kLeastTail_m = 20e-6;  ///< the same for a hard maximum, whose width is 0
/// A patch's depth follows its pairs at bounded speed, and may lag by so much.
inline constexpr double kPatchLag_m = 0.5e-3;
/// Cosine between a patch's direction and its pairs', at least: patches hold pairs up to 46 degrees from their own.
inline constexpr double kLeastAlignment = 0.7;
/// Cosine between a chart's axis and a contact's direction, at least: what decides a depth faces it within 66 degrees.
inline constexpr double kMostLeaning = 0.4;
/// Pieces of one patch lie within about four speculative distances of each other.
inline constexpr double kLayersReach = 4;

// When it is searched (depth_scheduler.cpp).
/// Who is so far from touching is not told apart from touching by a rounding, nor by a coarse pair's floor.
inline constexpr double kClearlyApart_m = 0.1e-3;
inline constexpr double kQuadratureWidths = 3;  ///< soft widths that a sum may be off by
inline constexpr double kLeastFacing = 0.5;     ///< cosine; what faces less squarely is no part of a patch
/// A contact that may push is extrapolated along a fraction of a ridge of 1.5 mm, and for so many answers, in which a
/// surface that is edited meanwhile is not seen.
inline constexpr double kAllowedWay_m = 0.12e-3, kAllowedAnswers = 8;
/// One that is too far apart is allowed this share of its gap: its gradient turns before it comes near.
inline constexpr double kGapShare = 0.4;
/// One that has gone less of its allowance is not worth a search yet. What may push always is, while the budget lasts,
/// because heights may arrive or change under it: its first answer after a search has an urgency of 1 / 9.
inline constexpr double kWorthASearch = 0.1;
/// On a budget, searches for which everything is done anew: one costs as much as several from what earlier ones kept.
inline constexpr std::uint64_t kCostlySearches = 1;

// How wide a soft maximum is (depth_stage.cpp, soft_widths.cpp).
/// A contact's arm from the tool's origin never counts as shorter when its stiffness against rotations is judged.
inline constexpr double kLeastArm_m = 10e-3;
/// A new contact's width may be anything: nothing was felt before.
inline constexpr double kLongAgo_s = 1;
/// Widening cannot help below this share of what the loop holds: the rest is g g^T, which has no width.
inline constexpr double kLeastShareHeld = 0.25;
/// Of what the loop holds: contacts that are stiffer keep their width.
inline constexpr double kClearlySofter = 0.6;
/// Of a width: a change by less is not worth asking for the contact again.
inline constexpr double kSameWidth = 0.01;

// How the sources are blended (depth_stage.cpp).
/// What a soft maximum loses against the exact depth where a tip touches, whose area is far below a0; steeper tips than
/// ten to one lose more. The coarse depth less this and the surfaces' relief is the least that is felt.
inline constexpr double kTipLossWidths = 10;
/// So far below touching, a floor adds no force to what is apart.
inline constexpr double kApartWidths = 3;
/// Gaps that are known in two ways and differ by less are the same: what a bake is off by at most, nearly everywhere.
inline constexpr double kSameGap_m = 0.1e-3;
/// What it gains where much of a plane touches, at most: where height fields are deeper than the coarse depth by so
/// much and the surfaces' relief, they take one layer for another.
inline constexpr double kWideGainWidths = 5;
/// Depths this far above the coarse pieces' need not know them: their share would be less than 1e-40.
inline constexpr double kWellAbove_m = 1e-3;

/// Cosines between a pair's direction and its patch's, from not counting to counting fully: 60 and 41 degrees.
inline constexpr double kUnaligned = 0.5, kAligned = 0.75;
inline constexpr double kNoShare = 1e-12;  ///< less of a source changes nothing in double

// Contacts that found the same place (duplicate_weights.cpp).
/// Cosines between contacts' forces, from not at all to fully the same way: 37 and 18 degrees.
inline constexpr double kUnlike = 0.8, kAlike = 0.95;
inline constexpr double kAsDeep_m = 50e-6;    ///< which of two is the shallower one shows within this
inline constexpr double kSettles_m = 0.3e-3;  ///< a stroke is soon elsewhere: at 1 mm errors on a dome double
inline constexpr double kSettles_s = 0.5;     ///< a hand and a tool swing far faster than that
inline constexpr double kLeastShare = 1e-3;   ///< less of a stiffness is not felt

}  // namespace farfeel::contact
