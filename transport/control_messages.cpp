#include "transport/control_messages.h"

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
std::span<const std::byte> write(const Bye& m, PayloadBuffer& to) noexcept {
  ByteWriter w(to);
  w.u8(static_cast<std::uint8_t>(m.reason));
  return w.written();
}

std::optional<Bye> read_bye(std::span<const std::byte> payload) noexcept {
  ByteReader r(payload);
  const std::uint8_t reason = r.u8();
  if (!r.is_at_end() || reason < 1 || reason > 3) return std::nullopt;
  return Bye{static_cast<ByeReason>(reason)};
}

}  // namespace farfeel::transport
