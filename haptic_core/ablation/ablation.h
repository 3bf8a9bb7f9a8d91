// What can be left out of the way from near pieces to a felt force, one mechanism at a time: to see what fails without.
//
// In the product ablated() is false at compile time, so that a condition on it leaves no code. The sources below are
// compiled a second time, with FARFEEL_ABLATION, for the program farfeel-bench-ablation alone; there it is a switch.
// Sources ask for it, headers never do: what they define is compiled in both ways within that program.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace farfeel::ablation {

enum class Mechanism : std::uint8_t {
  kCrossedSheets,
  kWitnessHops,
  kBoundedMoves,
  kOffAxes,
  kCoarseDepth,
  kPointFallback,
  kLayerCeiling,
  kPointBounds,
  kSiftedLeaves,
  kClosedForms,
  kKeptCells,
  kDepthScheduler,
  kSoftWidths,
  kWidthNames,
  kTwoWidths,
  kProxy,
  kDuplicateWeights,
  kKeptTangents,
  kOtherFlanks,
  kKeptBend,
  kSeenCurvature,
  kBendAsSeen,
  kSlowNews,
  kDampedWhenOld,
  kNewsAge,
  kFeltOnce,
  kStandIns,
  kRenamed,
  kSurprises,
  kPointLag,
  kSlopeLag,
  kTankSharing,
  kHoldBack,
  kAmidStep,
  kGapSprings,
  kPayback,
  kHandleEstimate,
  kTilesPace,
};

struct Named {
  Mechanism mechanism;
  std::string_view name;
  std::string_view source;  ///< where it is left out
};

/// One a line, in their order: the build and tests/structure/mechanisms.cmake read them here.
inline constexpr std::array kMechanisms{
    Named{Mechanism::kCrossedSheets, "crossed sheets", "haptic_core/contact/tracking/crossed_sheets.cpp"},
    Named{Mechanism::kWitnessHops, "witness hops", "haptic_core/contact/tracking/clustering.cpp"},
    Named{Mechanism::kBoundedMoves, "bounded moves", "haptic_core/contact/tracking/clustering.cpp"},
    Named{Mechanism::kOffAxes, "off axes", "haptic_core/contact/depth/contact_frame.cpp"},
    Named{Mechanism::kCoarseDepth, "coarse depth", "haptic_core/contact/depth/coarse_depth.cpp"},
    Named{Mechanism::kPointFallback, "point fallback", "haptic_core/contact/depth/points/point_fallback.cpp"},
    Named{Mechanism::kLayerCeiling, "layer ceiling", "haptic_core/contact/depth/points/point_fallback.cpp"},
    Named{Mechanism::kPointBounds, "point bounds", "haptic_core/contact/depth/points/point_depth.cpp"},
    Named{Mechanism::kSiftedLeaves, "sifted leaves", "haptic_core/contact/depth/points/point_depth.cpp"},
    Named{Mechanism::kClosedForms, "closed forms", "haptic_core/contact/depth/depth_stage.cpp"},
    Named{Mechanism::kKeptCells, "kept cells", "haptic_core/penetration/simd/kept_cells.cpp"},
    Named{Mechanism::kDepthScheduler, "depth scheduler", "haptic_core/contact/depth/depth_scheduler.cpp"},
    Named{Mechanism::kSoftWidths, "soft widths", "haptic_core/contact/depth/soft_widths.cpp"},
    Named{Mechanism::kWidthNames, "width names", "haptic_core/contact/depth/depth_stage.cpp"},
    Named{Mechanism::kTwoWidths, "two widths", "haptic_core/penetration/two_widths.cpp"},
    Named{Mechanism::kProxy, "proxy", "haptic_core/contact_service/proxy.cpp"},
    Named{Mechanism::kDuplicateWeights, "duplicate weights", "haptic_core/contact/depth/duplicate_weights.cpp"},
    Named{Mechanism::kKeptTangents, "kept tangents", "haptic_core/local_model/kept_tangents.cpp"},
    Named{Mechanism::kOtherFlanks, "other flanks", "haptic_core/local_model/kept_tangents.cpp"},
    Named{Mechanism::kKeptBend, "kept bend", "haptic_core/local_model/felt_contact.cpp"},
    Named{Mechanism::kSeenCurvature, "seen curvature", "haptic_core/local_model/seen_curvature.cpp"},
    Named{Mechanism::kBendAsSeen, "bend as seen", "haptic_core/local_model/received_contact.cpp"},
    Named{Mechanism::kSlowNews, "slow news", "haptic_core/local_model/received_contact.cpp"},
    Named{Mechanism::kDampedWhenOld, "damped when old", "haptic_core/local_model/contact_response.cpp"},
    Named{Mechanism::kNewsAge, "news age", "haptic_core/local_model/model_update.cpp"},
    Named{Mechanism::kFeltOnce, "felt once", "haptic_core/local_model/felt_once.cpp"},
    Named{Mechanism::kStandIns, "stand-ins", "haptic_core/local_model/local_contacts.cpp"},
    Named{Mechanism::kRenamed, "renamed contacts", "haptic_core/local_model/match.cpp"},
    Named{Mechanism::kSurprises, "surprises", "haptic_core/local_model/transition.cpp"},
    Named{Mechanism::kPointLag, "point lag", "haptic_core/local_model/transition.cpp"},
    Named{Mechanism::kSlopeLag, "slope lag", "haptic_core/local_model/transition.cpp"},
    Named{Mechanism::kTankSharing, "tank sharing", "haptic_core/local_model/local_model.cpp"},
    Named{Mechanism::kHoldBack, "hold back", "haptic_core/local_model/transition.cpp"},
    Named{Mechanism::kAmidStep, "amid the step", "haptic_core/local_model/local_model.cpp"},
    Named{Mechanism::kGapSprings, "gap springs", "haptic_core/local_model/contact_response.cpp"},
    Named{Mechanism::kPayback, "payback", "haptic_core/local_model/local_model.cpp"},
    Named{Mechanism::kHandleEstimate, "handle estimate", "master_station/haptic_loop/handle_estimate.cpp"},
    Named{Mechanism::kTilesPace, "tiles pace", "master_station/haptic_loop/haptic_loop.cpp"},
};

#ifdef FARFEEL_ABLATION
/// Set while nothing is computed.
inline std::array<bool, kMechanisms.size()> left_out{};
[[nodiscard]] inline bool ablated(Mechanism mechanism) noexcept {
  return left_out[static_cast<std::size_t>(mechanism)];
}
#else
[[nodiscard]] constexpr bool ablated(Mechanism) noexcept {
  return false;
}
#endif

}  // namespace farfeel::ablation

namespace farfeel {
using ablation::ablated;
using ablation::Mechanism;
}  // namespace farfeel
