// Packets without end, in simulated time: lanes whose counters stand near their last, and a road that loses, repeats
// and disorders. What comes out is compared with a list of all that went in.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace farfeel::end_to_end {

struct SimulatedResult {
  std::uint64_t packets = 0;     ///< sealed
  std::uint64_t opened = 0;      ///< of these, opened and believed, late ones too
  std::uint64_t refusals = 0;    ///< seal() had used up a key's counters, and said so
  std::uint64_t handshakes = 0;  ///< that made new keys
  double simulated_s = 0;
  std::vector<std::string> violations;
};

/// One lane by itself, both ways: sealed, carried over the road, opened. Each key begins some thousand counters before
/// its last. Violations: a message that was opened twice, or was never sealed; a newest one that is older than another;
/// a counter that came twice with a key.
[[nodiscard]] SimulatedResult carry(std::uint64_t packets, std::uint64_t seed);

/// A whole session, both lanes, greetings and all, on such a road, until so many datagrams were sent: its haptic keys
/// begin near their last counter too, each time, so that it lives from refusal to new keys. Violations: a pose that is
/// not newer than all before, at the slave; an answer that is not, at the master; a counter that came twice with a key;
/// a session that does not come back.
[[nodiscard]] SimulatedResult live(std::uint64_t packets, std::uint64_t seed);

}  // namespace farfeel::end_to_end
