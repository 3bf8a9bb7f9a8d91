// A WebSocket to a program on this machine: text out, text in. The client is libwebsockets (RFC 6455).
//
// Only IPv4 loopback is spoken to, and no name is looked up: what listens there is this machine's own service, and what
// it says is still bounded. Of several messages that wait only the newest is kept: they are states, not events.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "master_station/devices/channel/channel.h"

namespace farfeel::devices {

struct LoopbackAddress {
  std::string host;  ///< 127.0.0.1, or another of 127.0.0.0/8
  std::uint16_t port = 0;
  std::string path;  ///< "/" at least
};

/// Of ws://localhost:10001, ws://127.0.0.1:10001/path. Fails for anything that is not this machine.
[[nodiscard]] tl::expected<LoopbackAddress, std::string> loopback_address(std::string_view uri);

/// One thread. No call waits but receive(), and that until its deadline.
class TextChannel {
 public:
  static constexpr std::size_t kMaxMessage = 65536;  ///< bytes; a service that says more in one message is hung up on

  virtual ~TextChannel() = default;
  /// True after the handshake; false while it is under way and when the channel is gone.
  [[nodiscard]] virtual bool is_open() const noexcept = 0;
  /// kNothing: the one before is not sent yet, or the handshake is under way; this one was not taken.
  virtual ChannelState send(std::string_view text) noexcept = 0;
  /// The newest message that is whole and was not given before; valid until the next call. Waits for one until
  /// deadline_ns (CLOCK_MONOTONIC). Also what drives the handshake.
  virtual ChannelState receive(std::string_view& text, std::int64_t deadline_ns) noexcept = 0;
  /// Whole messages that came, those included which a newer one replaced.
  [[nodiscard]] virtual std::uint64_t messages() const noexcept = 0;
  [[nodiscard]] virtual int descriptor() const noexcept = 0;  ///< the socket, for the keeper; -1: none
  [[nodiscard]] virtual std::string trouble() const = 0;      ///< why it is gone; empty: it is not
};

/// Begins to connect, and returns at once.
[[nodiscard]] tl::expected<std::unique_ptr<TextChannel>, std::string> open_websocket(const LoopbackAddress&);

}  // namespace farfeel::devices
