#include <fmt/format.h>

#include "haptic_core/penetration/back_end.h"
#include "haptic_core/penetration/egl/frame_layout.h"
#include "haptic_core/penetration/height_bounds.h"

namespace farfeel::penetration::egl {
namespace {

constexpr const char* kHeights =
#include "haptic_core/penetration/egl/heights.glsl"
    ;
constexpr const char* kOverlap =
#include "haptic_core/penetration/egl/overlap.glsl"
    ;
constexpr const char* kSearch =
#include "haptic_core/penetration/egl/search.glsl"
    ;

}  // namespace

std::string heights_source() {
  return fmt::format(
             "#version 450 core\n#define HEIGHTS_BINDING {}\n#define BOUNDS_BINDING {}\n#define FRAME_BINDING {}\n"
             "#define BOUNDS_LEVELS {}\n#define BEND_UNIT {:.1f}\n",
             int{kHeightsBinding}, int{kBoundsBinding}, int{kFrameBinding}, kBoundsLevels, kBendUnit) +
         kHeights;
}

std::string search_source(std::uint32_t group, bool with_hessian) {
  std::string source = heights_source();
  const auto define = [&source](const char* name, int value) { source += fmt::format("#define {} {}\n", name, value); };
  const auto define_bits = [&source](const char* name, std::uint32_t value) {
    source += fmt::format("#define {} {}u\n", name, value);
  };
  define_bits("GROUP", group);
  define_bits("POOL", kPoolWords);
  define_bits("MOST_KEPT", kMostListedCells);
  define_bits("MOST_CELLS", kMostListedCells);
  define_bits("RESULT_WORDS", kResultWords);
  define_bits("STAMP", kStampAt);
  define_bits("WANTS_HESSIAN", kWantsHessian);
  define_bits("HARD", kHard);
  define_bits("RAW", kRaw);
  define_bits("HAS_RECALL", kHasRecall);
  define_bits("KNOWN", kKnown);
  define_bits("COARSE", kCoarse);
  define_bits("LAYERS", kLayers);
  define_bits("OVERFLOWS", kOverflows);
  define("RESULTS_BINDING", int{kResultsBinding}), define("WORKSPACE_BINDING", int{kWorkspaceBinding});
  source += fmt::format("#define EDGE_FADE {:.9f}\n", kEdgeFade_m);
  if (with_hessian) source += "#define HESSIAN\n";
  return source + kOverlap + kSearch;
}

}  // namespace farfeel::penetration::egl
