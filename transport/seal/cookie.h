// Cookies: how a slave under load makes a master prove its address before any expensive work is done for it.
//
// The slave computes the cookie anew from the sender's address and a secret, and so keeps nothing about strangers. It
// is sent sealed with a key made of the slave's public key, and bound to the initiation that it answers, so only who
// sent that initiation can use it. The answer is 64 B for 224 B: no amplifier. PROTOCOL.md's type 3:
//   u8 3, u8 version, u16 0, u32 receiver index; nonce 24 B; XChaCha20-Poly1305 of the cookie 16 + 16 B
//   key = BLAKE2b-256("cookie--" | slave's public key), associated = mac1 of the initiation.
//
// Times are of any clock that does not go back. One object, one thread at a time. Nothing allocates.
#pragma once

#include "transport/seal/handshake_messages.h"

namespace farfeel::transport {

/// How long the slave's secret is used, and then still believed; and how long a master uses a cookie.
inline constexpr std::int64_t kCookieLife_ns = 120'000'000'000;

/// The slave's side. address: the sender's, as any bytes that name it, port included.
class CookieMaker {
 public:
  explicit CookieMaker(const Key32& own_public) noexcept;
  ~CookieMaker();
  CookieMaker(const CookieMaker&) = delete;
  CookieMaker& operator=(const CookieMaker&) = delete;

  /// Whether mac2 was made with the cookie of that address. Precondition: datagram has a right mac1.
  [[nodiscard]] bool is_mac2_right(std::span<const std::byte> datagram, std::span<const std::byte> address,
                                   std::int64_t now_ns) noexcept;
  /// The reply to an initiation whose head was read without a fault.
  void write_reply(std::span<const std::byte> initiation, std::span<const std::byte> address, std::int64_t now_ns,
                   std::span<std::byte, kCookieReplyBytes> out) noexcept;

 private:
  void rotate(std::int64_t now_ns) noexcept;

  Key32 reply_key_;
  Key32 secret_{}, previous_{};
  std::int64_t since_ns_ = 0;  // when secret_ was made
  bool has_secret_ = false, has_previous_ = false;
};

/// The master's side, for one lane towards one address.
class CookieJar {
 public:
  explicit CookieJar(const Key32& remote_public) noexcept;

  /// Adds mac2 to an initiation about to be sent, if there is a cookie, and remembers which one it was.
  void sign(std::span<std::byte, kInitiationBytes> initiation, std::int64_t now_ns) noexcept;
  /// Keeps the cookie. False if the reply is not from who knows the slave's key, or answers none of the last
  /// kRemembered initiations.
  bool read_reply(std::span<const std::byte> datagram, std::int64_t now_ns) noexcept;
  [[nodiscard]] bool has_cookie(std::int64_t now_ns) const noexcept;

  /// Initiations are sent every 20 ms at first: the answer to each is known again for 1.28 s, far above a round trip.
  static constexpr std::size_t kRemembered = 64;

 private:
  struct Sent {
    std::uint32_t sender_index = 0;
    Mac16 mac1{};
  };
  Key32 reply_key_;
  std::array<Sent, kRemembered> sent_{};
  std::size_t sent_count_ = 0;
  std::optional<Cookie> cookie_;
  std::int64_t cookie_since_ns_ = 0;
};

}  // namespace farfeel::transport
