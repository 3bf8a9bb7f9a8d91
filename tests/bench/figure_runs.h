// The source's experiments without friction (Otaduy, Jain, Sud and Lin 2004, Figures 75 to 77 of the later thesis), as
// quasi-static runs of the contact service: a hand moves, a tool follows through springs and dampers.
#pragma once

#include <vector>

#include "haptic_core/contact_service/contact_service.h"

namespace farfeel::bench {

/// Two surfaces: S lies, T is laid on it with the orientation R_WT; both without friction.
struct Laid {
  const geometry::HapticSurface *s, *t;
  glm::dquat R_WT;
  glm::dvec3 above_W;  ///< of T's origin, above S, where the run starts to look for the surface [m]
  double tolerance_m = 0.005;
  double stiffness_N_per_m = 2000;  ///< of each surface
};

/// One frame of a tool that is pulled over ridges: x across them, y along.
struct Stroke {
  double hand_m, tool_m, height_m;  ///< x of hand and tool from the start, z of the tool
  double across_N, along_N;         ///< contact force on the tool, its mean over the frame
};
/// The hand moves by length_m along x while the tool is pressed down with press_N and does not turn.
[[nodiscard]] std::vector<Stroke> stroke_over_ridges(const Laid&, double length_m, double press_N, std::size_t frames);

/// One frame of a tool that is twisted on ridges it interlocks with.
struct Twist {
  double angle_rad;  ///< about z, as given
  double height_m;   ///< the tool's rise since the start
  double torque_Nm;  ///< contact torque about z
};
/// The tool is pressed down and twisted to and fro, `twists` times each way; it may rise and nothing else.
[[nodiscard]] std::vector<Twist> twist_interlocked(const Laid&, double most_rad, int twists, double press_N,
                                                   std::size_t frames);

/// What the source says of its curves, in figures.
struct StrokeFacts {
  double along_share;  ///< rms force along the ridges over rms force across
  double correlation;  ///< of the force across with how far the tool lags behind the hand
  int stairs;          ///< how often the tool slips: moves more than twice as fast as the hand
};
[[nodiscard]] StrokeFacts facts_of(const std::vector<Stroke>&);
struct TwistFacts {
  double rises;    ///< share of the twists with a rise of at least a tenth of the greatest
  double opposes;  ///< share of the frames, twisted more than a tenth of the way, whose torque opposes the twist
  double rise_m;   ///< mean of the greatest of each twist
};
[[nodiscard]] TwistFacts facts_of(const std::vector<Twist>&, int twists);

[[nodiscard]] double correlation(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace farfeel::bench
