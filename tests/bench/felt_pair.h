// An object and a tool, ready to be felt by both ends of a link. No sockets, no files.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/motion/scripted_motion.h"
#include "haptic_core/penetration/felt_surface.h"

namespace farfeel::bench {

/// The object stands still unless told otherwise. Both are of one material, which is told where it matters.
class FeltPair {
 public:
  FeltPair(std::string name, geometry::HapticSurface object, geometry::HapticSurface tool, double tolerance_m = 0.005,
           const spatial::Pose& X_WO = {});
  FeltPair(const FeltPair&) = delete;
  FeltPair& operator=(const FeltPair&) = delete;

  /// The object moves by a script from now on.
  void move_by(motion::ScriptedMotion script) { script_ = std::move(script); }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::optional<motion::ScriptedMotion>& script() const { return script_; }
  [[nodiscard]] contact_service::TouchableObject object(const contact::Material&) const;
  [[nodiscard]] contact_service::TouchableObject tool(const contact::Material&) const;
  [[nodiscard]] const contact_service::ContactOptions& options() const { return options_; }
  /// A fresh one, as the remote node has it.
  [[nodiscard]] contact_service::ContactService service(const contact::Material&) const;
  [[nodiscard]] const geometry::HapticSurface& surface(std::uint32_t index) const {
    return index == 0 ? tool_ : object_;
  }

 private:
  std::string name_;
  geometry::HapticSurface object_, tool_;
  contact_service::ContactOptions options_;
  spatial::Pose X_WO_;
  std::optional<motion::ScriptedMotion> script_;
  penetration::FeltSurface object_felt_, tool_felt_;
};

}  // namespace farfeel::bench
