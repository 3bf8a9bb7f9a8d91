#include "codecs/felt/session_object.h"

#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {

std::vector<std::byte> session_object(const SessionObject& object) {
  std::vector<std::byte> bytes(sizeof(std::uint32_t) + object.scene.size() + object.felt.size());
  transport::ByteWriter w(bytes);
  w.u32(static_cast<std::uint32_t>(object.scene.size()));
  w.bytes(object.scene);
  w.bytes(object.felt);
  return bytes;
}

std::optional<SessionObject> session_object_in(std::span<const std::byte> bytes) {
  transport::ByteReader r(bytes);
  SessionObject object;
  object.scene = r.bytes(r.u32());
  object.felt = r.bytes(r.remaining());
  if (!r.ok()) return std::nullopt;
  return object;
}

}  // namespace farfeel::codecs
