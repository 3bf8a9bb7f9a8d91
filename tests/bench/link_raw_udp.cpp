#include <sys/socket.h>

#include <utility>

#include "tests/bench/connected_sockets.h"
#include "tests/bench/link_method.h"

namespace farfeel::bench {
namespace {

class RawEnd final : public LinkEnd {
 public:
  explicit RawEnd(int socket) : socket_(socket) {}
  bool send(std::span<const std::byte> message) override {
    return ::send(socket_, message.data(), message.size(), MSG_DONTWAIT) == static_cast<ssize_t>(message.size());
  }
  std::size_t receive(std::span<std::byte> to) override {
    const ssize_t size = recv(socket_, to.data(), to.size(), MSG_DONTWAIT);
    return size > 0 ? static_cast<std::size_t>(size) : 0;
  }
  void wait_until(std::int64_t until_ns) override { wait_readable(socket_, until_ns); }

 private:
  int socket_;
};

class RawUdp final : public LinkMethod {
 public:
  explicit RawUdp(ConnectedSockets sockets)
      : sockets_(std::move(sockets)), master_(sockets_.master()), slave_(sockets_.slave()) {}
  LinkEnd& master() override { return master_; }
  LinkEnd& slave() override { return slave_; }

 private:
  ConnectedSockets sockets_;
  RawEnd master_, slave_;
};

}  // namespace

MadeMethod make_raw_udp(const TwoEnds& ends) {
  auto sockets = ConnectedSockets::open(ends);
  if (!sockets) return tl::unexpected(sockets.error());
  return std::make_unique<RawUdp>(std::move(*sockets));
}

}  // namespace farfeel::bench
