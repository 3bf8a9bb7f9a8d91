// The one object that a session begins with: what is seen, and the outline of what is felt.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace farfeel::codecs {

struct SessionObject {
  std::span<const std::byte> scene;  ///< codecs::read_scene
  std::span<const std::byte> felt;   ///< codecs::read_felt_outline; empty: nothing is felt but contacts
};

[[nodiscard]] std::vector<std::byte> session_object(const SessionObject&);
/// The parts, which point into the bytes; nothing when those are too few to be one.
[[nodiscard]] std::optional<SessionObject> session_object_in(std::span<const std::byte>);

}  // namespace farfeel::codecs
