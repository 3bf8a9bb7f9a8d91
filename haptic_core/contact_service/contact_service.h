// World in, tool pose in, contacts out: everything the remote node computes about touch, without sockets or threads.
//
// One answer is: proximity of every object's convex pieces to the tool's, clusters of near pairs, the textured
// penetration depth of each cluster, the penalty wrench and friction. Clusters that are still apart are answered too:
// the operator's local model needs them before they touch.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/doubts.h"
#include "haptic_core/contact_service/tiles_under.h"
#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact_service {

/// A surface that can be touched. The surface must outlive the service and keep its place.
struct TouchableObject {
  const geometry::HapticSurface* felt = nullptr;  ///< in O; the tool's origin is its centre of mass
  contact::Material material;
  spatial::Pose X_WO{};  ///< unused for the tool, and for what moves
  /// The same surface made ready, where somebody keeps it so; else the service makes its own. As long-lived as felt.
  const penetration::FeltSurface* prepared = nullptr;
  const motion::ScriptedMotion* motion = nullptr;  ///< null: it stands still. As long-lived as felt.
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
};

/// kTruth is the reference run so finely that it converges: seconds an answer, for benchmarks. kGiven is made by
/// ContactOptions::maker.
enum class DepthBackEnd { kSimd, kReference, kTruth, kGiven };

/// The stiffest wall that the haptic loop is tested against [N/m].
inline constexpr double kHeldStiffness_N_per_m = 10'000;

struct ContactOptions {
  double tolerance_m = 0.005;       ///< > 0; contacts are looked for up to this distance
  std::uint32_t grid_samples = 50;  ///< N of the penetration grid
  double soft_width_m = 10e-6;      ///< 0 asks for the hard maximum
  /// Textured contacts that would be stiffer in any direction get a wider soft maximum, answer by answer; 0: never, so
  /// that a contact's depth is a function of the pose alone. Programs that render ask for kHeldStiffness_N_per_m.
  double most_stiffness_N_per_m = 0;
  /// Contacts that come, go or change at once are handed over (contact/handover.h); false: felt as found.
  bool hands_over = true;
  DepthBackEnd back_end = DepthBackEnd::kSimd;
  const penetration::BackEndMaker* maker = nullptr;  ///< of kGiven; must outlive the service
  const HeightPresence* heights = nullptr;           ///< null: all are at hand
  /// For answers in every tick of a loop: textured contacts that are asked of the back end in one answer, and no more
  /// once one was costly (BackEnd::searches); the others are carried from their last. 0: all. See
  /// penetration/search_budget.h.
  std::uint32_t most_searches = 0;
};

/// Wall-clock time of the last answer by stage [us], and what was done for it.
struct StageTimes {
  double proximity_us = 0, clusters_us = 0, penetration_us = 0, assembly_us = 0, total_us = 0;
  std::uint32_t grids = 0;           ///< contacts that the back end was asked for
  std::uint32_t twins = 0;           ///< contacts that went with another one in their place instead
  std::uint32_t closed_forms = 0;    ///< contacts without texture: no grid, no back end
  std::uint32_t floors = 0;          ///< contacts held against the coarse pieces' exact depth
  std::uint32_t point_contacts = 0;  ///< contacts that are no height field, felt as points at least in part
  std::uint32_t points = 0;          ///< that were looked at for them
  std::uint32_t frictions = 0;       ///< contacts with a friction state
  std::uint32_t hessians = 0;        ///< contacts whose stiffness was looked at
  std::uint32_t handed = 0;          ///< contacts that are being handed over
  double made_J = 0;    ///< energy stored that came with this answer and not by the tool's way, for a ledger
  double widest_m = 0;  ///< of the soft widths in use
  double behind_m = 0;  ///< how far behind the tool depths were looked up, see proxy.h
};

class ContactService {
 public:
  /// Prepares hull trees, surfaces and workspaces; the only place that allocates.
  ContactService(std::span<const TouchableObject> objects, const TouchableObject& tool, const ContactOptions&);
  ~ContactService();
  ContactService(ContactService&&) noexcept;
  ContactService& operator=(ContactService&&) noexcept;

  /// Contacts at a tool pose. The reference stays valid until the next call. One thread at a time.
  [[nodiscard]] const contact::ContactSet& answer(const ToolPose&) noexcept;

  /// Of a contact of the last answer, some of whose heights are not at hand and are stood in for: how far its depth is
  /// from the true one, at most [m]. None: all are at hand.
  [[nodiscard]] std::optional<double> outline_off_m(std::uint32_t contact_id) const noexcept;

  /// The tiles that contacts at a tool pose are made from, nearest contact first, and those up to margin_m beside them;
  /// some twice. soft_width_m: of all contacts, where it is more than asked for. The history is the answers' own:
  /// whoever asks about other poses keeps a service for that and restarts it. Valid until the next call.
  [[nodiscard]] std::span<const SurfaceTile> tiles_needed(const ToolPose&, double margin_m, double soft_width_m = 0);

  /// How many contacts there were, near ones too, at the last pose that was asked about.
  [[nodiscard]] std::uint32_t contacts_near() const noexcept;

  /// The fastest that the tool's surface and an object's move past each other where they are near. tool: the last pose
  /// that was asked about.
  [[nodiscard]] double fastest_near_m_s(const ToolPose& tool) const noexcept;

  /// The objects that move, where they were at the last pose that was asked about.
  [[nodiscard]] const motion::MovingObjects& moving() const noexcept;

  /// Forgets the contacts' history: ids start anew, as after the tool has been put somewhere else.
  void restart() noexcept;

  /// That pose, at the place where the contacts of the last answer were looked up (proxy.h): tiles are needed there.
  [[nodiscard]] ToolPose at_proxy(ToolPose tool) const noexcept;
  [[nodiscard]] const StageTimes& last_times() const noexcept;
  /// Of all answers so far.
  [[nodiscard]] const contact::DoubtCounts& doubts() const noexcept;

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace farfeel::contact_service
