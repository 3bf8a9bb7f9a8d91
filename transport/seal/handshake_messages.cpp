#include "transport/seal/handshake_messages.h"

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
namespace {

constexpr std::size_t kInitiationHeadBytes = 8;  // in every version

bool is_lane(std::uint8_t lane) {
  return lane < kLaneKinds;
}
bool is_suite(std::uint8_t suite) {
  return suite == static_cast<std::uint8_t>(Suite::kAesGcm) || suite == static_cast<std::uint8_t>(Suite::kChaChaPoly);
}
bool is_type(std::uint8_t type, DatagramType wanted) {
  return type == static_cast<std::uint8_t>(wanted);
}

}  // namespace

InitiationHead read_initiation_head(std::span<const std::byte> datagram, const Key32& own_mac1_key) noexcept {
  InitiationHead head;
  ByteReader r(datagram);
  const std::uint8_t type = r.u8(), version = r.u8(), suite = r.u8(), lane = r.u8();
  head.sender_index = r.u32();
  if (datagram.size() < kInitiationHeadBytes + 2 * kMacBytes || !is_type(type, DatagramType::kInitiation)) return head;
  if (version == kLinkVersion && (datagram.size() != kInitiationBytes || !is_lane(lane))) return head;
  if (!is_mac1_right(own_mac1_key, datagram)) {
    if (version == kLinkVersion) head.fault = HeadFault::kWrongKey;
  } else if (version != kLinkVersion) {
    head.fault = HeadFault::kOtherVersion;
  } else if (!is_suite(suite) || !is_available(static_cast<Suite>(suite))) {
    head.fault = HeadFault::kOtherSuite;
  } else {
    head.fault = HeadFault::kNone;
    head.suite = static_cast<Suite>(suite);
    head.lane = static_cast<LaneKind>(lane);
  }
  return head;
}

std::optional<ResponseHead> read_response_head(std::span<const std::byte> datagram,
                                               const Key32& own_mac1_key) noexcept {
  if (datagram.size() != kResponseBytes) return std::nullopt;
  ByteReader r(datagram);
  const std::uint8_t type = r.u8(), version = r.u8(), suite = r.u8(), lane = r.u8();
  ResponseHead head;
  head.sender_index = r.u32();
  head.receiver_index = r.u32();
  if (!is_type(type, DatagramType::kResponse) || version != kLinkVersion || !is_suite(suite) || !is_lane(lane) ||
      !is_mac2_zero(datagram) || !is_mac1_right(own_mac1_key, datagram))
    return std::nullopt;
  head.suite = static_cast<Suite>(suite);
  head.lane = static_cast<LaneKind>(lane);
  return head;
}

void write_denial(const Denial& denial, std::span<std::byte, kDenialBytes> out) noexcept {
  ByteWriter w(out);
  w.u8(static_cast<std::uint8_t>(DatagramType::kDenial));
  w.u8(denial.version);
  w.u8(static_cast<std::uint8_t>(denial.reason));
  w.u8(0);
  w.u32(denial.receiver_index);
}

std::optional<Denial> read_denial(std::span<const std::byte> datagram) noexcept {
  ByteReader r(datagram);
  const std::uint8_t type = r.u8();
  Denial denial;
  denial.version = r.u8();
  const std::uint8_t reason = r.u8(), zero = r.u8();
  denial.receiver_index = r.u32();
  if (!r.is_at_end() || !is_type(type, DatagramType::kDenial) || zero != 0 ||
      reason < static_cast<std::uint8_t>(DenialReason::kOtherSuite) ||
      reason > static_cast<std::uint8_t>(DenialReason::kOldCounter))
    return std::nullopt;
  denial.reason = static_cast<DenialReason>(reason);
  return denial;
}

}  // namespace farfeel::transport
