#include "transport/seal/cookie.h"

#include <sodium.h>

#include <algorithm>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
namespace {

constexpr std::size_t kNonceBytes = crypto_aead_xchacha20poly1305_ietf_NPUBBYTES;
constexpr std::size_t kSealedCookieBytes = kMacBytes + crypto_aead_xchacha20poly1305_ietf_ABYTES;
constexpr std::size_t kHeadBytes = 8;
static_assert(kHeadBytes + kNonceBytes + kSealedCookieBytes == kCookieReplyBytes);
constexpr std::size_t kSenderIndexAt = 4;  // in an initiation

constexpr char kCookieLabel[8] = {'c', 'o', 'o', 'k', 'i', 'e', '-', '-'};

unsigned char* raw(std::byte* p) {
  return reinterpret_cast<unsigned char*>(p);
}
const unsigned char* raw(const std::byte* p) {
  return reinterpret_cast<const unsigned char*>(p);
}

std::uint32_t sender_index_in(std::span<const std::byte> initiation) {
  ByteReader r(initiation.subspan(kSenderIndexAt));
  return r.u32();
}

}  // namespace

CookieMaker::CookieMaker(const Key32& own_public) noexcept : reply_key_(labelled_key(kCookieLabel, own_public)) {}

CookieMaker::~CookieMaker() {
  wipe(secret_);
  wipe(previous_);
}

// A secret serves for one life as the current and for one as the previous: a cookie is good for one to two lives.
void CookieMaker::rotate(std::int64_t now_ns) noexcept {
  if (has_secret_ && now_ns - since_ns_ < kCookieLife_ns) return;
  has_previous_ = has_secret_ && now_ns - since_ns_ < 2 * kCookieLife_ns;
  previous_ = secret_;
  fill_randomly(secret_);
  has_secret_ = true;
  since_ns_ = now_ns;
}

bool CookieMaker::is_mac2_right(std::span<const std::byte> datagram, std::span<const std::byte> address,
                                std::int64_t now_ns) noexcept {
  rotate(now_ns);
  return transport::is_mac2_right(keyed_mac(secret_, address), datagram) ||
         (has_previous_ && transport::is_mac2_right(keyed_mac(previous_, address), datagram));
}

void CookieMaker::write_reply(std::span<const std::byte> initiation, std::span<const std::byte> address,
                              std::int64_t now_ns, std::span<std::byte, kCookieReplyBytes> out) noexcept {
  rotate(now_ns);
  const Cookie cookie = keyed_mac(secret_, address);
  const Mac16 mac1 = mac1_in(initiation);
  ByteWriter w(out);
  w.u8(static_cast<std::uint8_t>(DatagramType::kCookieReply));
  w.u8(kLinkVersion);
  w.u16(0);
  w.u32(sender_index_in(initiation));
  const auto nonce = out.subspan(kHeadBytes, kNonceBytes);
  fill_randomly(nonce);
  crypto_aead_xchacha20poly1305_ietf_encrypt(raw(out.data()) + kHeadBytes + kNonceBytes, nullptr, raw(cookie.data()),
                                             cookie.size(), raw(mac1.data()), mac1.size(), nullptr, raw(nonce.data()),
                                             raw(reply_key_.data()));
}

CookieJar::CookieJar(const Key32& remote_public) noexcept : reply_key_(labelled_key(kCookieLabel, remote_public)) {}

void CookieJar::sign(std::span<std::byte, kInitiationBytes> initiation, std::int64_t now_ns) noexcept {
  if (has_cookie(now_ns)) write_mac2(*cookie_, initiation);
  sent_[sent_count_++ % kRemembered] = {sender_index_in(initiation), mac1_in(initiation)};
}

bool CookieJar::read_reply(std::span<const std::byte> datagram, std::int64_t now_ns) noexcept {
  if (datagram.size() != kCookieReplyBytes) return false;
  ByteReader r(datagram);
  const std::uint8_t type = r.u8(), version = r.u8();
  const std::uint16_t zero = r.u16();
  const std::uint32_t receiver_index = r.u32();
  if (type != static_cast<std::uint8_t>(DatagramType::kCookieReply) || version != kLinkVersion || zero != 0)
    return false;
  const auto nonce = r.bytes(kNonceBytes), sealed = r.bytes(kSealedCookieBytes);
  for (std::size_t i = 0; i < std::min(sent_count_, kRemembered); ++i) {
    if (sent_[i].sender_index != receiver_index) continue;
    Cookie cookie;
    if (crypto_aead_xchacha20poly1305_ietf_decrypt(raw(cookie.data()), nullptr, nullptr, raw(sealed.data()),
                                                   sealed.size(), raw(sent_[i].mac1.data()), sent_[i].mac1.size(),
                                                   raw(nonce.data()), raw(reply_key_.data())) != 0)
      continue;
    cookie_ = cookie;
    cookie_since_ns_ = now_ns;
    return true;
  }
  return false;
}

bool CookieJar::has_cookie(std::int64_t now_ns) const noexcept {
  return cookie_.has_value() && now_ns - cookie_since_ns_ < kCookieLife_ns;
}

}  // namespace farfeel::transport
