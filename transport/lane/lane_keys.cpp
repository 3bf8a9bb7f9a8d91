#include "transport/lane/lane_keys.h"

#include <array>
#include <cstring>

namespace farfeel::transport {

std::uint32_t new_local_index(LaneKind lane) {
  std::uint32_t index = 0;
  while (index < 2) {
    std::array<std::byte, sizeof index> random;
    fill_randomly(random);
    std::memcpy(&index, random.data(), sizeof index);
    index = (index & ~1u) | (lane == LaneKind::kHaptic ? 0u : 1u);
  }
  return index;
}

std::uint64_t random_identity() {
  std::uint64_t number = 0;
  while (number == 0) fill_randomly(std::as_writable_bytes(std::span(&number, 1)));
  return number;
}

std::uint32_t random_session() {
  std::uint32_t id = 0;
  while (id == 0) id = static_cast<std::uint32_t>(random_identity());
  return id;
}

}  // namespace farfeel::transport
