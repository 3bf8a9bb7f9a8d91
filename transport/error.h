// What can fail on the way to a session, and what to say about it.
#pragma once

#include <cstdint>
#include <string>

namespace farfeel::transport {

enum class ErrorKind : std::uint8_t {
  kAddress,   ///< an address that cannot be read or looked up
  kRefused,   ///< an address or peer that this milestone does not talk to
  kSocket,    ///< the operating system said no
  kTimeout,   ///< nobody answered in time
  kProtocol,  ///< the peer speaks another version, or sent what cannot be used
};

/// The message says what was tried, what was wrong and what to do.
struct Error {
  ErrorKind kind;
  std::string message;
};

}  // namespace farfeel::transport
