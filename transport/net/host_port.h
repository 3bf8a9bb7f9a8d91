// The text of an address in its two parts.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "transport/error.h"
#include "transport/net/address.h"

namespace farfeel::transport {

struct HostPort {
  std::string host;  ///< not empty; a name or a numeric address, without brackets
  std::uint16_t port = 0;
};

/// Fails (kAddress) where a bracket, the host or the port is missing or malformed.
[[nodiscard]] tl::expected<HostPort, Error> split_host_port(const std::string& text,
                                                            std::optional<std::uint16_t> default_port);
/// The address if host is a numeric one, nothing if it may be a name. Fails (kAddress) on a numeric one that cannot be
/// used. `text` is what was typed, for the message.
[[nodiscard]] tl::expected<std::optional<Address>, Error> numeric_address(const std::string& text, const HostPort&);

}  // namespace farfeel::transport
