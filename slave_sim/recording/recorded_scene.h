// A felt asset made ready for a contact service, and for edits.
#pragma once

#include <deque>
#include <span>
#include <vector>

#include "codecs/recording/felt_asset.h"
#include "haptic_core/motion/moving_objects.h"
#include "slave_sim/session/editable_surfaces.h"

namespace farfeel::slave_sim {

class RecordedScene {
 public:
  RecordedScene(contact_service::FeltScene scene, std::span<const motion::MovingObject> moving)
      : scene_(std::move(scene)) {
    for (const motion::MovingObject& object : moving)
      if (object.object + 1 < scene_.bodies.size()) scene_.bodies[object.object + 1].motion = object.script;
    for (contact_service::FeltBody& body : scene_.bodies) {
      penetration::FeltSurface& felt = felt_.emplace_back(body.surface);
      surfaces_.add(body.surface, felt);
      bodies_.push_back({&body.surface, body.material, body.X_WO, &felt, body.motion ? &*body.motion : nullptr});
    }
  }
  RecordedScene(const RecordedScene&) = delete;
  RecordedScene& operator=(const RecordedScene&) = delete;

  /// The tool, then the objects.
  [[nodiscard]] std::span<const contact_service::TouchableObject> bodies() const { return bodies_; }
  [[nodiscard]] contact_service::ContactService service(const contact_service::ContactOptions& options) const {
    return {bodies().subspan(1), bodies().front(), options};
  }
  [[nodiscard]] EditableSurfaces& surfaces() { return surfaces_; }

 private:
  contact_service::FeltScene scene_;
  std::deque<penetration::FeltSurface> felt_;
  EditableSurfaces surfaces_;
  std::vector<contact_service::TouchableObject> bodies_;
};

}  // namespace farfeel::slave_sim
