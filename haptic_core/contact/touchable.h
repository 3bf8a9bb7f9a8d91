// What contacts are found between, where, and how: the words that every stage of an answer shares.
#pragma once

#include <cstdint>
#include <span>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/material.h"
#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/motion/scripted_motion.h"
#include "haptic_core/penetration/back_end.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

/// The tool is surface 0, scene object k is surface k + 1.
inline constexpr std::uint32_t kToolSurface = 0;

/// A height tile of one surface.
struct SurfaceTile {
  std::uint32_t surface = kToolSurface;
  std::uint32_t tile = 0;  ///< index into HapticSurface::tiles
  friend bool operator==(const SurfaceTile&, const SurfaceTile&) = default;
};

/// One tile in place of another: the unit of surface edits. Heights of neighbours must agree where tiles repeat them.
struct SurfaceEdit {
  SurfaceTile where;
  geometry::HeightTile tile;  ///< of a newer version than the one that it replaces
};

/// A surface that can be touched. The surface must outlive the service and keep its place.
struct TouchableObject {
  const geometry::HapticSurface* felt = nullptr;  ///< in O; the tool's origin is its centre of mass
  Material material;
  spatial::Pose X_WO{};  ///< unused for the tool, and for what moves
  /// The same surface made ready, where somebody keeps it so; else the service makes its own. As long-lived as felt.
  const penetration::FeltSurface* prepared = nullptr;
  const motion::ScriptedMotion* motion = nullptr;  ///< null: it stands still. As long-lived as felt.
  bool may_change = false;                         ///< courses may be told of it while the scene lives
  bool is_there = true;                            ///< until a course says otherwise
};

/// Says which heights are at hand, where some are still on their way and coarser ones stand in for them.
class HeightPresence {
 public:
  virtual ~HeightPresence() = default;
  [[nodiscard]] virtual bool has(const SurfaceTile&) const noexcept = 0;
  /// No height of a tile is farther from what stands in for it [m]; 0 where it is at hand.
  [[nodiscard]] virtual double off_m(const SurfaceTile&) const noexcept = 0;
  /// Whether all of a surface's are; false where nobody counts.
  [[nodiscard]] virtual bool has_all(std::uint32_t /*surface*/) const noexcept { return false; }
};

struct ToolPose {
  std::uint32_t sequence = 0;
  std::int64_t time_ns = 0;  ///< scene time: since the sender's haptic loop began; echoed
  spatial::Pose X_WT;
  spatial::Twist V_WT_W;         ///< of To
  bool wants_curvature = false;  ///< of every contact's depth: a textured contact then costs about twice as much
  bool wants_wrench = true;      ///< the contacts' sum; false: ContactSet::F_To_W is zero, and friction begins anew
};

/// The stiffest wall that the haptic loop is tested against [N/m].
inline constexpr double kHeldStiffness_N_per_m = 10'000;

struct ContactOptions {
  double tolerance_m = 0.005;       ///< > 0; contacts are looked for up to this distance
  std::uint32_t grid_samples = 50;  ///< N of the penetration grid
  double soft_width_m = 10e-6;      ///< 0 asks for the hard maximum
  /// Textured contacts that would be stiffer in any direction get a wider soft maximum, answer by answer; 0: never, so
  /// that a contact's depth is a function of the pose alone. Programs that render ask for kHeldStiffness_N_per_m.
  double most_stiffness_N_per_m = 0;
  penetration::BackEndMaker maker{};        ///< of the back end; empty: simd
  const HeightPresence* heights = nullptr;  ///< null: all are at hand
  /// For answers in every tick of a loop: textured contacts that are asked of the back end in one answer, and no more
  /// once one was costly (BackEnd::searches); the others are extrapolated. 0: all that may push. See
  /// depth/depth_scheduler.h.
  std::uint32_t most_searches = 0;
};

/// Wall-clock time of an answer by stage [us], and what was done for it.
struct StageTimes {
  double proximity_us = 0, clusters_us = 0, penetration_us = 0, assembly_us = 0, total_us = 0;
  std::uint32_t grids = 0;           ///< contacts that the back end was asked for
  std::uint32_t closed_forms = 0;    ///< contacts without texture: no grid, no back end
  std::uint32_t floors = 0;          ///< contacts held against the coarse pieces' exact depth
  std::uint32_t point_contacts = 0;  ///< contacts that are no height field, felt as points at least in part
  std::uint32_t points = 0;          ///< that were looked at for them
  std::uint32_t frictions = 0;       ///< contacts with a friction state
  std::uint32_t hessians = 0;        ///< contacts whose stiffness was looked at
  std::uint32_t left_out = 0;        ///< contacts, the shallowest, where there were more than kMaxContacts
  double widest_m = 0;               ///< of the soft widths in use
};

/// The contacts at a pose, and what only the node that found them knows.
struct Answer : ContactSet {
  glm::dvec3 p_PT_W{0};  ///< from the place where depths were looked up to the tool's; zero while it is shallow
  const motion::MovingObjects* moving = nullptr;  ///< the service's: where objects are that move, until its next answer
  StageTimes times;

  /// A pose like the tool's, at the place where depths were looked up: tiles are needed there.
  [[nodiscard]] ToolPose at_proxy(ToolPose tool) const noexcept {
    tool.X_WT.p -= p_PT_W;
    return tool;
  }
};

/// The tiles that contacts at a pose are made from.
struct TilesNeeded {
  std::span<const SurfaceTile> tiles;  ///< the nearest contact's first; some twice
  std::uint32_t contacts = 0;          ///< near ones, too
  double fastest_m_s = 0;  ///< that the tool's surface and an object's move past each other where they are near
};

}  // namespace farfeel::contact
