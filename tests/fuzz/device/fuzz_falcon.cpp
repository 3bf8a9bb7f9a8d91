// Any bytes as IN transfers of a Falcon, cut by their own first bytes: readings that are in range and kinematics that
// are finite or refuse; and the same bytes as a firmware file.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "codecs/device/falcon.h"
#include "codecs/device/falcon_kinematics.h"
#include "codecs/device/ftdi.h"

namespace {

using namespace farfeel::codecs;

void check(const FalconReading& reading) {
  if (reading.buttons > 15 || reading.homed > 7) std::abort();
  const auto angles = falcon_angles_of_counts(reading.counts);
  const auto p_F = falcon_position(angles);
  if (!p_F) return;
  if (!(std::hypot(p_F->x, p_F->y, p_F->z) < 0.3)) std::abort();  // 0.06 + 0.125 m of arm, less than 0.05 m of base
  const auto J = falcon_jacobian(*p_F, angles);
  if (!J) return;
  for (const std::int16_t value : falcon_motors(*J, {8, -8, 8}).values)
    if (std::abs(value) > 4096) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  auto rest = std::as_bytes(std::span(data, size));
  (void)falcon_firmware_trouble(rest);
  FalconStream stream;
  std::uint64_t taken = 0;
  while (!rest.empty()) {
    const std::size_t n = std::min<std::size_t>(std::to_integer<std::size_t>(rest[0]) + 1, rest.size());
    std::array<std::byte, 256> payload;
    const std::size_t bytes = ftdi_payload(rest.first(n), payload);
    if (bytes > n) std::abort();
    taken += bytes;
    if (const auto reading = stream.take(std::span(payload).first(bytes))) check(*reading);
    rest = rest.subspan(n);
  }
  // Each byte is told, thrown away, or waits for the rest of its packet.
  const std::uint64_t told = kFalconPacketBytes * stream.readings() + stream.discarded_bytes();
  if (told > taken || taken - told >= kFalconPacketBytes) std::abort();
  return 0;
}
