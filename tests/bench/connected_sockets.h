// Two plain non-blocking UDP sockets, each connected to the other.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

#include "tests/bench/two_ends.h"

namespace farfeel::bench {

class ConnectedSockets {
 public:
  [[nodiscard]] static tl::expected<ConnectedSockets, std::string> open(const TwoEnds&);
  ConnectedSockets(ConnectedSockets&& other) noexcept;
  ConnectedSockets& operator=(ConnectedSockets&&) = delete;
  ~ConnectedSockets();

  [[nodiscard]] int master() const { return master_; }
  [[nodiscard]] int slave() const { return slave_; }

 private:
  ConnectedSockets() = default;
  int master_ = -1, slave_ = -1;
};

/// Sleeps until the socket can be read or until_ns (CLOCK_MONOTONIC) is past.
void wait_readable(int descriptor, std::int64_t until_ns);

}  // namespace farfeel::bench
