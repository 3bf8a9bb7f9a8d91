// Junk handshakes at a slave's door, as many as asked for, and what they cost the session that goes on there.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace farfeel::end_to_end {

/// A flooding process's whole life: sends initiations at that rate until it is killed, half of them with a right first
/// mac, as anybody can make who knows the slave's public key: a quarter of a second to the slave's door, as long to
/// another port of this machine, by turns. Writes how many it has sent to the descriptor.
[[noreturn]] void pour(std::uint16_t door, std::uint16_t elsewhere, double per_s, int tell);

struct FloodResult {
  /// Medians over the blocks [us], of blocks under the flood and of blocks whose flood went to another port.
  double p99_us = 0, p99_elsewhere_us = 0, p50_us = 0, p50_elsewhere_us = 0;
  double per_s = 0, per_s_elsewhere = 0;  ///< that left
  std::uint64_t answers = 0, shaken = 0;  ///< that count, and those that do not: this machine stood still meanwhile
  double ratio() const { return p99_elsewhere_us > 0 ? p99_us / p99_elsewhere_us : 0; }
};
/// program: this one, which can be a slave and a flood, too. blocks: of either place, a quarter of a second each.
[[nodiscard]] FloodResult measure_flood(const std::string& program, int blocks, double per_s);

}  // namespace farfeel::end_to_end
