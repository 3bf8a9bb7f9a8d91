// What the way from near pieces to a felt force does, counted: steps, cells, samples. Times differ between machines and
// from run to run; counts of the same motion do not, so a test can hold them.
//
// The product counts nothing: there count() is empty, and leaves no code. The sources below are compiled a second time,
// with FARFEEL_COUNT_WORK, for the program farfeel-bench-count alone. Counters that were always there, however cheap,
// would have to pass through every kernel's interface, and would share cache lines with what ticks read.
// Sources ask for it, headers never do: what they define is compiled in both ways within that program.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace farfeel::counting {

enum class Work : std::uint8_t {
  kQueries,
  kNodes,
  kPairs,
  kGjkSteps,
  kGjkWalks,
  kTranslations,
  kFaces,
  kEdgePairs,
  kWitnessLooks,
  kNearPairs,
  kTriangles,
  kDepths,
  kSearches,
  kCellsSifted,
  kCellsLooked,
  kCellsLaid,
  kNodesLaid,
  kSamples,
  kSecondSamples,
  kPoints,
};

/// One a kind of work, in their order.
inline constexpr std::array<std::string_view, 20> kNames{
    "queries",         // of proximity, each for one object at one pose
    "nodes",           // pairs of nodes of two hull trees that were visited
    "pairs",           // of convex pieces whose distance was measured
    "gjk_steps",       // looks at all vertices of a pair along one direction
    "gjk_walks",       // pairs for which the last answer's simplex did not hold
    "translations",    // overlapping pairs whose least translation was looked for
    "faces",           // of those, each compared with the other piece's vertices
    "edge_pairs",      // of those, that were left to cross
    "witness_looks",   // vertices and edges looked at to find the witnesses of those
    "near_pairs",      // found nearer than the tolerance
    "triangles",       // projected into a contact's plane
    "depths",          // that the simd back end was asked for
    "searches",        // by branch and bound, for those
    "cells_sifted",    // bounded by the relief alone
    "cells_looked",    // bounded, and sampled where that is not enough
    "cells_laid",      // of a search's first level, and by dividing
    "nodes_laid",      // of sums
    "samples",         // taken and added up, or added up as they had been taken
    "second_samples",  // of these, with second derivatives
    "points",          // felt one by one
};

inline namespace
#ifdef FARFEEL_COUNT_WORK
    counted {
/// Of this process since it began, or since somebody set it to zero. One thread.
inline std::array<std::uint64_t, kNames.size()> done{};
inline void count(Work work, std::uint64_t times = 1) noexcept {
  done[static_cast<std::size_t>(work)] += times;
}
}  // namespace counted
#else
    uncounted {
constexpr void count(Work, std::uint64_t = 1) noexcept {}
}  // namespace uncounted
#endif

}  // namespace farfeel::counting

namespace farfeel {
using counting::Work;
}  // namespace farfeel
