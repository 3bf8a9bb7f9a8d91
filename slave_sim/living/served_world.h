// What a session serves of a world: its bodies made ready for the threads that look at them, the service that answers
// with contacts, and the feed of height tiles. The program and whoever measures it put a node together from this.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/living/living_scene.h"
#include "slave_sim/session/service_contacts.h"
#include "slave_sim/session/slave_session.h"
#include "slave_sim/world/world.h"

namespace farfeel::slave_sim {

/// Everything that can be touched, and what it is touched with, made ready for one thread, which may change it.
class Touch {
 public:
  explicit Touch(const World&);
  [[nodiscard]] const contact_service::TouchableObject& tool() const { return tool_; }
  [[nodiscard]] const std::vector<contact_service::TouchableObject>& objects() const { return objects_; }
  [[nodiscard]] EditableSurfaces& editable() { return editable_; }
  [[nodiscard]] std::vector<contact_service::TouchableObject> bodies() const;  ///< the tool, then the objects

 private:
  struct Body {
    explicit Body(const geometry::HapticSurface& of) : surface(of), felt(surface) {}
    geometry::HapticSurface surface;
    penetration::FeltSurface felt;
  };
  contact_service::TouchableObject add(const codecs::Asset&, const spatial::Pose& X_WO);

  std::vector<std::unique_ptr<Body>> bodies_;
  EditableSurfaces editable_;
  contact_service::TouchableObject tool_;
  std::vector<contact_service::TouchableObject> objects_;
};

/// Whether anything of it has texture.
[[nodiscard]] bool is_textured(const World&);

class ServedWorld {
 public:
  /// As the scene is in the beginning: before any edit. The world must outlive it. maker: of penetration depths; empty:
  /// simd.
  ServedWorld(const World&, const LivingScene&, penetration::BackEndMaker maker = {});
  ServedWorld(const ServedWorld&) = delete;
  ServedWorld& operator=(const ServedWorld&) = delete;

  /// What has changed since the beginning, before the session begins. What masters are told first stays what it was, so
  /// that one who knows it needs the changes alone.
  void take(const LivingScene::Changes&);

  /// It must outlive the session, of which the contact thread asks.
  [[nodiscard]] ContactSource& contacts() { return contacts_; }
  /// What masters get to feel with; its tiles are the session's io thread's from then on.
  [[nodiscard]] const SlaveSession::Felt& felt() const { return felt_; }
  /// Why masters feel linearised contacts only; empty where they feel more.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  contact_service::ContactOptions options_;
  Touch touch_;  // the contact thread's
  contact_service::ContactService service_;
  ServiceContacts contacts_;
  std::optional<Touch> fed_;  // the io thread's: it looks at surfaces, too
  std::optional<TileFeed> tiles_;
  SlaveSession::Felt felt_;
  std::string trouble_;
};

}  // namespace farfeel::slave_sim
