// The edits that a scene's file asks for, made ready before anybody feels the scene, and done when their time comes.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "slave_sim/edits/object_change.h"
#include "slave_sim/edits/stamp.h"
#include "slave_sim/session/slave_session.h"
#include "slave_sim/world/world.h"

namespace farfeel::slave_sim {

class Timeline {
 public:
  /// Gives the surfaces of the world that are to be stamped room for it, before anybody copies them, and works out all
  /// edits. Fails where a stamp cannot be, and says what could.
  [[nodiscard]] static tl::expected<Timeline, SceneError> of(World& world);

  /// Does what is due at that scene time. say: a line for each.
  void advance(double scene_s, SlaveSession& session, const std::function<void(const std::string&)>& say);
  /// All versions of tiles that will come.
  [[nodiscard]] std::vector<SurfaceEdit> tiles_to_come() const;
  [[nodiscard]] bool is_over() const { return next_ == edits_.size(); }

 private:
  struct Edit {
    double at_s = 0;
    std::string words;
    std::vector<SurfaceEdit> tiles;
    std::optional<ObjectChange> change;
  };
  std::vector<Edit> edits_;
  std::size_t next_ = 0;
};

}  // namespace farfeel::slave_sim
