// Asks a slave for its scene as it is now.
#pragma once

#include <functional>
#include <string>
#include <tl/expected.hpp>

#include "codecs/wire/edit_messages.h"
#include "master_station/editing/side_link.h"

namespace farfeel::master_station {

struct SavedScene {
  codecs::SaveAnswer answer;
  transport::ReceivedObject object;  ///< its hash is the answer's
};

/// Over a link that takes kSaved and is up. Asks until it is answered, again in a new session, and waits for as long as
/// bytes come; gives up after quiet_s without any. Fails in words, also when is_stopped says so.
[[nodiscard]] tl::expected<SavedScene, std::string> asked_scene(SideLink&, double quiet_s,
                                                                const std::function<bool()>& is_stopped);

}  // namespace farfeel::master_station
