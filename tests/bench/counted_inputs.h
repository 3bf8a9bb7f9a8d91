// What work is counted over, as files: where a tool goes and which surfaces it meets. Neither the machine nor the bake
// changes them; a list beside them has the hash of each.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/recording/recorded_scene.h"

namespace farfeel::bench {

/// A tool on an object. Bodies are in the order of RemoteAcrossLink: the tool, then the object.
struct CountedScene {
  std::unique_ptr<slave_sim::RecordedScene> asset;
  std::vector<contact_service::TouchableObject> bodies;
  std::vector<spatial::Pose> motion;  ///< of the tool in the object's frame, or of a handle; one a tick

  [[nodiscard]] std::span<const contact_service::TouchableObject> objects() const {
    return std::span(bodies).subspan(1);
  }
};

class CountedInputs {
 public:
  /// A folder with inputs.json, NAME.poses and assets/; assets of recordings beside it are found too. Throws CLI::Error
  /// where the list can't be read.
  explicit CountedInputs(std::filesystem::path folder);

  /// Throws CLI::Error with what is missing, or is not what the list says.
  [[nodiscard]] CountedScene scene(const std::string& name) const;

  /// Makes all of them anew, from today's bake: counts begin anew with them. The assets of benchmark scenes are those
  /// of recordings.
  static void freeze(const std::filesystem::path& folder);

 private:
  std::filesystem::path folder_;
  nlohmann::json list_;
};

}  // namespace farfeel::bench
