#include "codecs/device/ftdi.h"

#include <algorithm>

namespace farfeel::codecs {

std::size_t ftdi_payload(std::span<const std::byte> transfer, std::span<std::byte> payload) noexcept {
  std::size_t filled = 0;
  while (transfer.size() > kFtdiStatusBytes) {
    const auto packet = transfer.first(std::min(transfer.size(), kFtdiPacketBytes));
    const auto data = packet.subspan(kFtdiStatusBytes);
    const std::size_t n = std::min(data.size(), payload.size() - filled);
    std::copy_n(data.begin(), n, payload.begin() + static_cast<std::ptrdiff_t>(filled));
    filled += n;
    transfer = transfer.subspan(packet.size());
  }
  return filled;
}

}  // namespace farfeel::codecs
