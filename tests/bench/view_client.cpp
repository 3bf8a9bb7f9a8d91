#include "tests/bench/view_client.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::bench {
namespace {

constexpr std::int64_t kPatience_ns = 10'000'000'000;
constexpr std::byte kBinary{0x82}, kMasked{0x80};

}  // namespace

ViewClient::ViewClient(const std::string& address) {
  int port = 0;
  std::array<char, 64> token{};
  if (std::sscanf(address.c_str(), "http://127.0.0.1:%d/#%63s", &port, token.data()) != 2) {
    trouble_ = "no address of a view: " + address;
    return;
  }
  fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const std::string host = fmt::format("127.0.0.1:{}", port);
  const std::string hello = fmt::format(
      "GET / HTTP/1.1\r\nHost: {0}\r\nOrigin: http://{0}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: "
      "farfeel-view\r\n\r\n",
      host);
  if (::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 ||
      ::send(fd_, hello.data(), hello.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(hello.size())) {
    trouble_ = "nobody listens at " + host;
    return;
  }
  const std::int64_t until_ns = realtime::monotonic_now_ns() + kPatience_ns;
  for (;;) {
    const std::string_view text(reinterpret_cast<const char*>(bytes_.data()), bytes_.size());
    const std::size_t end = text.find("\r\n\r\n");
    if (end != std::string_view::npos) {
      if (!text.starts_with("HTTP/1.1 101")) trouble_ = "the view refused: " + std::string(text.substr(0, 40));
      bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(end + 4));
      break;
    }
    if (!receive(until_ns)) {
      trouble_ = "the view did not answer";
      return;
    }
  }
  send(codecs::write_view_token(token.data()));
}

ViewClient::~ViewClient() {
  if (fd_ >= 0) ::close(fd_);
}

/// One short frame. Its mask is zero: a mask guards proxies, of which there is none.
void ViewClient::send(std::span<const std::byte> message) {
  std::vector<std::byte> frame{kBinary, kMasked | static_cast<std::byte>(message.size())};
  frame.resize(6);
  frame.insert(frame.end(), message.begin(), message.end());
  if (::send(fd_, frame.data(), frame.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(frame.size()))
    trouble_ = "the view hung up";
}

bool ViewClient::receive(std::int64_t until_ns) {
  const std::int64_t left_ms = (until_ns - realtime::monotonic_now_ns()) / 1'000'000;
  pollfd wait{fd_, POLLIN, 0};
  if (left_ms <= 0 || ::poll(&wait, 1, static_cast<int>(left_ms)) != 1) return false;
  std::array<std::byte, 1 << 16> piece;
  const ssize_t got = ::recv(fd_, piece.data(), piece.size(), 0);
  if (got <= 0) {
    trouble_ = "the view hung up";
    return false;
  }
  bytes_.insert(bytes_.end(), piece.begin(), piece.begin() + got);
  return true;
}

/// The next whole frame. The view sends each message as one.
std::optional<std::vector<std::byte>> ViewClient::message() {
  if (bytes_.size() < 2) return std::nullopt;
  std::size_t size = std::to_integer<std::size_t>(bytes_[1]) & 0x7F, head = 2;
  const std::size_t wide = size == 126 ? 2 : size == 127 ? 8 : 0;
  if (bytes_.size() < head + wide) return std::nullopt;
  if (wide > 0) {
    size = 0;
    for (std::size_t i = 0; i < wide; ++i) size = size << 8 | std::to_integer<std::size_t>(bytes_[head + i]);
    head += wide;
  }
  if (bytes_.size() < head + size) return std::nullopt;
  const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(head),
             end = begin + static_cast<std::ptrdiff_t>(size);
  std::vector<std::byte> whole(begin, end);
  bytes_.erase(bytes_.begin(), end);
  return whole;
}

std::optional<codecs::ViewTick> ViewClient::next(std::int64_t until_ns) {
  while (trouble_.empty()) {
    while (const auto whole = message()) {
      auto tick = codecs::read_view_tick(*whole);
      if (!tick) continue;
      send(codecs::write_view_taken(tick->number));
      return tick;
    }
    if (!receive(until_ns)) break;
  }
  return std::nullopt;
}

}  // namespace farfeel::bench
