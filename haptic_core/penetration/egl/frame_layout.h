// What the processor and the compute shaders agree on: where the words of a frame and of its results stand.
//
// A frame is words of four (std430 uvec4), each contact a run of them:
//   header (kHeaderWords), facets of S, of T (kFacetWords each), charts of S, of T (kChartWords), edges of S, of T
//   (kEdgeWords).
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace farfeel::penetration::egl {

using Word4 = std::array<std::uint32_t, 4>;  ///< floats as their bits

inline constexpr std::uint32_t kHeaderWords = 8, kFacetWords = 4, kChartWords = 8, kEdgeWords = 2;
inline constexpr std::uint32_t kResultWords = 128;  ///< of 32 bits, a contact

/// Shader storage blocks.
enum Binding : std::uint32_t { kHeightsBinding, kBoundsBinding, kFrameBinding, kResultsBinding, kWorkspaceBinding };
/// Bits of a contact's header.
enum Wish : std::uint32_t {
  kWantsHessian = 1u << 0,
  kHard = 1u << 1,       ///< the hard maximum: candidates in place of sums
  kRaw = 1u << 2,        ///< its grid as it is
  kHasRecall = 1u << 3,  ///< a place where the peak may be
};
/// Bits of a result's first word.
enum Outcome : std::uint32_t {
  kKnown = 1u << 0,
  kCoarse = 1u << 1,
  kLayers = 1u << 2,
  kOverflows = 1u << 3,  ///< the search outgrew its memory: there is no answer
};
// Words of a result.
inline constexpr std::uint32_t kOutcomeAt = 0, kLevelAt = 1, kCandidateCountAt = 2, kRoundsAt = 3, kSumsAt = 4,
                               kStepAt = 46, kCandidatesAt = 48, kStampAt = 127;
inline constexpr std::uint32_t kMostCandidates = 16;  ///< u, v and overlap (the first) or its bound each

inline constexpr std::uint32_t kPoolWords = 7168;         ///< of shared memory: 28 of the 32 KiB that OpenGL grants
inline constexpr std::uint32_t kMostListedCells = 16384;  ///< that a level may keep

/// The functions with which shaders find felt heights, after the version and the constants above.
[[nodiscard]] std::string heights_source();
/// The search's source for work-groups of this many invocations, a power of two from 64 to 1024.
[[nodiscard]] std::string search_source(std::uint32_t group, bool with_hessian);

}  // namespace farfeel::penetration::egl
