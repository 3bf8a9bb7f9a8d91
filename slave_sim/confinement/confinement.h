// What the slave gives up before strangers can reach it, in three steps: privileges before it reads anything, files
// before it loads its scene, calls before it listens. What the machine cannot do is told, and the rest holds.
#pragma once

#include <functional>
#include <string>
#include <tl/expected.hpp>

#include "slave_sim/world/scene_definition.h"

namespace farfeel::slave_sim {

struct ConfinementWish {
  bool is_on = true;
  std::string user;                  ///< whom root becomes; empty: see transport/confine/privileges.h
  std::string penetration = "auto";  ///< as in DepthWish: a graphics driver needs more than the slave itself
  std::function<void(const std::string&)> say, warn;  ///< a line for a person
};

/// One thread; the first two steps while there is no other.
class Confinement {
 public:
  explicit Confinement(ConfinementWish);

  /// Fails where a privilege could not be given up: do not go on.
  [[nodiscard]] tl::expected<void, std::string> drop_privileges() const;
  /// To read: the scene's assets, the folder of keys, what libraries need; to write: the cache, if the scene has models
  /// to bake. Where a graphics driver may be loaded: every file to read, and the devices and the drivers' caches.
  void restrict_files(const SceneDefinition&, const std::string& keys_folder) const;
  /// After a driver was loaded, before the first bind.
  void restrict_calls(bool is_textured) const;

 private:
  [[nodiscard]] bool may_load_driver(bool is_textured) const;
  ConfinementWish wish_;
  bool has_device_;  // asked before the folder of devices is closed
};

}  // namespace farfeel::slave_sim
