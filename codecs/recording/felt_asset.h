// What a recorded session was felt on, as bytes: the outline of what is felt, and every height exactly. Recordings name
// it by its hash.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/contact_service/felt_scene.h"

namespace farfeel::codecs {

struct FeltAsset {
  std::vector<std::byte> outline;    ///< read_felt_outline()
  contact_service::FeltScene scene;  ///< of the outline, with all heights in place of those that stand in for them
};

/// bodies: as for write_felt_outline().
[[nodiscard]] tl::expected<std::vector<std::byte>, std::string> write_felt_asset(
    std::span<const contact_service::TouchableObject> bodies, const contact_service::ContactOptions&);
/// For bytes from anybody.
[[nodiscard]] tl::expected<FeltAsset, std::string> read_felt_asset(std::span<const std::byte>);

}  // namespace farfeel::codecs
