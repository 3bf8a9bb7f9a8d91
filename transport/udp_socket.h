// UDP addresses and non-blocking sockets, of this machine only.
//
// Nothing on this wire is sealed yet: whoever can send a datagram can move the tool. Until the secure session exists
// both ends refuse every address but loopback, and say so.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "transport/error.h"

namespace farfeel::transport {

/// An IPv4 or IPv6 address with a port. A plain value: compares and copies.
struct Address {
  bool is_ipv6 = false;
  std::array<std::uint8_t, 16> ip{};  ///< network order; the first 4 bytes for IPv4
  std::uint16_t port = 0;

  [[nodiscard]] Address with_port(std::uint16_t other) const;
  [[nodiscard]] bool has_ip_of(const Address& other) const { return is_ipv6 == other.is_ipv6 && ip == other.ip; }
  [[nodiscard]] bool is_loopback() const;  ///< 127.0.0.0/8 or ::1
  friend bool operator==(const Address&, const Address&) = default;
};

/// "127.0.0.1:4000" or "[::1]:4000".
[[nodiscard]] std::string to_string(const Address&);
/// The text form of to_string, "localhost:PORT", or a bare host with default_port. Numeric only: no name is looked up.
/// Fails for anything that is not loopback, saying why and what to do.
[[nodiscard]] tl::expected<Address, Error> loopback_address(const std::string& text,
                                                            std::optional<std::uint16_t> default_port = {});

/// The refusal of an address that is_loopback() denies.
[[nodiscard]] Error not_loopback(const Address&);
/// 127.0.0.1 or ::1 with port 0.
[[nodiscard]] Address loopback(bool is_ipv6 = false);

/// CLOCK_MONOTONIC now [ns]. Realtime-safe.
[[nodiscard]] std::int64_t monotonic_ns() noexcept;

/// A datagram as it was received.
struct Received {
  std::span<const std::byte> bytes;  ///< into the caller's buffer
  Address from;
  std::int64_t time_ns = 0;  ///< CLOCK_MONOTONIC at its arrival in the kernel, from SO_TIMESTAMPNS where it can be had
};

/// A bound, non-blocking UDP socket. Movable, closes itself. After open(), no call allocates, blocks or throws.
class UdpSocket {
 public:
  /// Port 0 takes a free one. Refuses any address but loopback.
  [[nodiscard]] static tl::expected<UdpSocket, Error> open(const Address& local);
  /// Two sockets on neighbouring ports PORT and PORT + 1; with port 0, on some free such pair.
  [[nodiscard]] static tl::expected<std::array<UdpSocket, 2>, Error> open_pair(const Address& local);

  UdpSocket(UdpSocket&& other) noexcept;
  UdpSocket& operator=(UdpSocket&& other) noexcept;
  ~UdpSocket();

  /// From now on receives only from this peer, and send() goes there. Refuses any address but loopback.
  [[nodiscard]] tl::expected<void, Error> connect(const Address& peer);

  /// False if the kernel took nothing: its buffer is full, or nobody listens there. Never retried: state goes stale.
  bool send(std::span<const std::byte> datagram) noexcept;
  bool send_to(const Address&, std::span<const std::byte> datagram) noexcept;
  /// The next waiting datagram, or nothing. Longer ones than the buffer are skipped.
  [[nodiscard]] std::optional<Received> receive(std::span<std::byte> buffer) noexcept;
  /// Waits until something can be received or until_ns is past (CLOCK_MONOTONIC). For threads with nothing else to do.
  bool wait_until(std::int64_t until_ns) noexcept;

  [[nodiscard]] const Address& local() const noexcept { return local_; }
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }

 private:
  UdpSocket(int descriptor, const Address& local) : descriptor_(descriptor), local_(local) {}
  int descriptor_ = -1;
  Address local_;
};

}  // namespace farfeel::transport
