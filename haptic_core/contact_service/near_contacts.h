// The first stages of an answer: which places of which objects are near the tool.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "haptic_core/collision/proximity_query.h"
#include "haptic_core/contact/clustering.h"
#include "haptic_core/contact/crossed_sheets.h"
#include "haptic_core/contact/point_fallback.h"
#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/penetration/felt_surface.h"
#include "haptic_core/penetration/penetration.h"

namespace farfeel::contact_service {

/// What the service keeps for each scene object.
struct FeltObject {
  FeltObject(const TouchableObject& object, const TouchableObject& tool, const collision::HullTree& tool_tree,
             contact::LayeredSurface& tool_layers, double tolerance_m, bool has_points);

  spatial::Pose X_WO;          ///< at the scene time at hand
  contact::Material material;  ///< of the object and the tool
  std::unique_ptr<penetration::FeltSurface> own_felt;
  const penetration::FeltSurface* felt;
  bool is_textured;                           ///< the object or the tool
  std::unique_ptr<collision::HullTree> tree;  ///< behind a pointer: the query keeps its address
  collision::ProximityQuery proximity;
  contact::CrossedSheets crossed;
  std::unique_ptr<contact::LayeredSurface> layers;    ///< behind a pointer: the fallback keeps its address
  std::unique_ptr<contact::PointFallback> as_points;  ///< for contacts that are no height field
  std::span<const collision::ProximityPair> pairs;    ///< of the answer at hand
  contact::Clustering clustering;
};

/// One cluster on its way to being a contact.
struct NearContact {
  std::uint32_t id = 0;  ///< Contact::id
  std::uint32_t object = 0;
  contact::Cluster cluster;
  // The rest is the next stage's: see depths.h.
  double soft_width_m = 0;
  std::span<const std::uint32_t> triangles_s, triangles_t;
  penetration::Penetration depth;  ///< unknown where the patches share nothing
  bool lacks_heights = false;      ///< not all are at hand: the outline's stand in
  double outline_off_m = 0;        ///< and the depth is farther from the true one by no more than this
  contact::PointShare layers;      ///< how much it is no height field because pieces lie above each other
};

class NearContacts {
 public:
  /// has_points: whether tips of height fields may be felt as points; layers are. The only place that allocates.
  NearContacts(std::span<const TouchableObject> objects, const TouchableObject& tool, double tolerance_m,
               bool has_points);

  /// Puts the objects that move to where they are at that scene time. Realtime-safe.
  void go_to(double scene_s) noexcept;
  /// dt_s: since the last. Realtime-safe.
  void find(const spatial::Pose& X_WT, double dt_s, StageTimes& times) noexcept;
  void restart() noexcept;

  /// As found last.
  [[nodiscard]] std::span<NearContact> all() noexcept { return {near_.data(), count_}; }
  [[nodiscard]] std::span<const NearContact> all() const noexcept { return {near_.data(), count_}; }
  [[nodiscard]] const FeltObject& object_of(const NearContact& near) const { return objects_[near.object]; }
  [[nodiscard]] std::span<const FeltObject> objects() const { return objects_; }
  /// How deep this contact may be looked up: by the thinnest of its pieces, see proxy.h.
  [[nodiscard]] double deepest_m(const NearContact&) const noexcept;
  [[nodiscard]] const penetration::FeltSurface& tool_felt() const { return *tool_felt_; }
  [[nodiscard]] std::uint32_t pairs() const { return pairs_; }
  [[nodiscard]] const motion::MovingObjects& moving() const { return moving_; }

 private:
  double tolerance_m_;
  std::unique_ptr<penetration::FeltSurface> own_tool_felt_;
  const penetration::FeltSurface* tool_felt_;
  std::unique_ptr<collision::HullTree> tool_tree_;
  std::unique_ptr<contact::LayeredSurface> tool_layers_;
  std::vector<FeltObject> objects_;
  motion::MovingObjects moving_;
  std::array<NearContact, contact::kMaxContacts> near_{};
  std::size_t count_ = 0;
  std::uint32_t pairs_ = 0;
};

}  // namespace farfeel::contact_service
