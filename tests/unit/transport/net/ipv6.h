// Whether this machine can be tested with IPv6.
#pragma once

#include "transport/net/udp_socket.h"

namespace farfeel::transport {

inline bool has_ipv6() {
  return UdpSocket::open(loopback(true)).has_value();
}

}  // namespace farfeel::transport
