// The relay's own key, kept in a file that its user alone can read.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "transport/error.h"
#include "transport/seal/macs.h"

namespace farfeel::transport {

/// $XDG_CONFIG_HOME or ~/.config, then /farfeel/relay.key.
[[nodiscard]] std::string default_relay_key_path();
/// Reads the key, or makes one, with the folders above it, where there is no file. Fails (kRefused) where others could
/// read it, (kAddress) where it is no key, (kSocket) where the system says no.
[[nodiscard]] tl::expected<Key32, Error> read_or_make_relay_key(const std::string& path);

}  // namespace farfeel::transport
