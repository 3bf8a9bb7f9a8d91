// Every tuned number of this room, with its unit and why it is as large as it is.
#pragma once

#include <cstddef>

namespace farfeel::contact {

// Which patch a pair belongs to (clustering.cpp). A pair's distance D to a patch is 1 at the patch's rim.
inline constexpr double kLeave =
    1.5;  ///< D beyond which a pair leaves its patch: half a radius of slack against tremor
inline constexpr double kSwitch = 0.25;  ///< how much nearer another patch has to be before a pair changes
inline constexpr double kMerge = 0.3;    ///< two patches that are nearer than this become one
/// Speculative distances: what is deeper than one of them weighs no more.
inline constexpr double kMostWeight = 2;
/// Added to D: opposed directions are farther apart than any place, and two patches with names farther than one
/// without.
inline constexpr double kOpposed = 1e6, kSettled = 1e3;
/// In space six directions can be mutually opposed or square, no more: so many places are kept for the walls of a slot.
inline constexpr std::size_t kKeptForOpposed = 5;
/// 20 degrees: a witness whose direction turns further, and a track whose predecessor pushed so much aside, is on
/// another side of the tool.
inline constexpr double kSameSideCosine = 0.94;
/// The place that a witness hopped from is forgotten with this time, and along this way of the witness: where a surface
/// moves on, it is soon elsewhere.
inline constexpr double kHopKept_s = 0.1, kHopKept_m = 0.1e-3;

// Sheets that have passed through each other (crossed_sheets.cpp).
/// Shares of how far apart they may be, and of how thick both may be together, from which on a pair counts less.
inline constexpr double kNearlyThrough = 0.75, kNearlyTooThick = 0.8;
inline constexpr double kRoundingOfCosines = 1e-9;  ///< and far more
inline constexpr double kNeverTurned_rad = 1e300;   ///< ago: nothing is known
inline constexpr std::size_t kMostPairs = 16'384;   ///< as a proximity query reports

// How deep anything is looked up (deepest.h).
/// Of what is thick there; the rest to a half is for what the coarse mesh and a tick's way are off.
inline constexpr double kDeepestShare = 0.4;
/// Nothing is looked up deeper, however thick the material is: a face's neighbours turn away within millimetres.
inline constexpr double kDeepest_m = 2e-3;
/// Any contact may be looked up so deep: less is within what the coarse mesh is off.
inline constexpr double kLeastDeepest_m = 0.1e-3;

}  // namespace farfeel::contact
