#include "transport/relay/relay_token.h"

#include <array>
#include <string_view>

namespace farfeel::transport {
namespace {

constexpr std::string_view kPrefix = "farfeel-relay-";
constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
constexpr std::size_t kTokenBytes = RelayGrant::kBytes + sizeof(Key32);  // 56
constexpr std::size_t kTextDigits = (kTokenBytes * 8 + 5) / 6;           // 75, of six bits each

std::array<std::byte, RelayGrant::kBytes> bytes_of(const RelayGrant& grant) noexcept {
  std::array<std::byte, RelayGrant::kBytes> bytes{};
  ByteWriter writer(bytes);
  grant.write(writer);
  return bytes;
}

}  // namespace

void RelayGrant::write(ByteWriter& writer) const noexcept {
  writer.u64(id);
  writer.u64(expiry_s);
  writer.u32(rate_kbit);
  writer.u16(most_ends);
  writer.u16(0);
}

RelayGrant RelayGrant::read(ByteReader& reader) noexcept {
  RelayGrant grant;
  grant.id = reader.u64();
  grant.expiry_s = reader.u64();
  grant.rate_kbit = reader.u32();
  grant.most_ends = reader.u16();
  (void)reader.u16();
  return grant;
}

RelayToken make_token(const Key32& of_relay, const RelayGrant& grant) noexcept {
  return {grant, derived_key(of_relay, bytes_of(grant))};
}

std::string to_string(const RelayToken& token) {
  std::array<std::byte, kTokenBytes> bytes{};
  ByteWriter writer(bytes);
  token.grant.write(writer);
  writer.bytes(token.key);
  std::string text(kPrefix);
  for (std::size_t digit = 0; digit < kTextDigits; ++digit) {
    unsigned value = 0;
    for (std::size_t bit = digit * 6; bit < digit * 6 + 6; ++bit)
      value =
          value << 1 | (bit / 8 < bytes.size() ? std::to_integer<unsigned>(bytes[bit / 8]) >> (7 - bit % 8) & 1 : 0);
    text += kDigits[value];
  }
  return text;
}

tl::expected<RelayToken, Error> parse_token(const std::string& typed) {
  const auto fail = [](const std::string& why) {
    return tl::unexpected(Error{ErrorKind::kAddress, "cannot read the relay's token: " + why +
                                                         ". Paste the whole line that `farfeel-relay token` printed."});
  };
  constexpr const char* kSpace = " \t\r\n";
  const auto begin = typed.find_first_not_of(kSpace);
  if (begin == std::string::npos) return fail("it is empty");
  const std::string text = typed.substr(begin, typed.find_last_not_of(kSpace) + 1 - begin);
  if (!text.starts_with(kPrefix)) return fail("it does not begin with " + std::string(kPrefix));
  if (text.size() != kPrefix.size() + kTextDigits)
    return fail("it has " + std::to_string(text.size()) + " characters instead of " +
                std::to_string(kPrefix.size() + kTextDigits));
  std::array<std::byte, kTokenBytes> bytes{};
  for (std::size_t digit = 0; digit < kTextDigits; ++digit) {
    const auto value = kDigits.find(text[kPrefix.size() + digit]);
    if (value == std::string_view::npos) return fail("it has a character that no token has");
    for (std::size_t i = 0; i < 6; ++i) {
      const std::size_t bit = digit * 6 + i;
      if ((value >> (5 - i) & 1) == 0) continue;
      if (bit / 8 >= bytes.size()) return fail("its last character is not a token's");
      bytes[bit / 8] |= std::byte{1} << (7 - bit % 8);
    }
  }
  ByteReader reader(bytes);
  RelayToken token;
  token.grant = RelayGrant::read(reader);
  const auto key = reader.bytes(token.key.size());
  std::copy(key.begin(), key.end(), token.key.begin());
  if (bytes_of(token.grant)[22] != bytes[22] || bytes_of(token.grant)[23] != bytes[23])
    return fail("it is a later version's");
  return token;
}

RoomId room_id(const RelayToken& token, const std::string& name) noexcept {
  return keyed_mac(token.key, std::as_bytes(std::span(name)));
}

}  // namespace farfeel::transport
