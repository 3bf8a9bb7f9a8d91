#include "tests/bench/connected_sockets.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "transport/net/arrival_clock.h"
#include "transport/net/socket_address.h"

namespace farfeel::bench {
namespace {

sockaddr* generic(sockaddr_storage& storage) {
  return reinterpret_cast<sockaddr*>(&storage);
}

bool connect_to_local_address_of(int socket, int other) {
  sockaddr_storage to{};
  socklen_t size = sizeof to;
  return getsockname(other, generic(to), &size) == 0 && connect(socket, generic(to), size) == 0;
}

}  // namespace

tl::expected<ConnectedSockets, std::string> ConnectedSockets::open(const TwoEnds& ends) {
  ConnectedSockets made;
  bool is_open = true;
  for (const auto end : {TwoEnds::End::kMaster, TwoEnds::End::kSlave}) {
    ends.in(end, [&] {
      const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
      (end == TwoEnds::End::kMaster ? made.master_ : made.slave_) = socket;
      sockaddr_storage local{};
      const socklen_t size = transport::to_sockaddr(ends.address(end), local);
      is_open = is_open && socket >= 0 && bind(socket, generic(local), size) == 0;
    });
  }
  is_open = is_open && connect_to_local_address_of(made.master_, made.slave_) &&
            connect_to_local_address_of(made.slave_, made.master_);
  if (!is_open) return tl::unexpected(fmt::format("cannot connect two UDP sockets: {}", std::strerror(errno)));
  return made;
}

ConnectedSockets::ConnectedSockets(ConnectedSockets&& other) noexcept
    : master_(std::exchange(other.master_, -1)), slave_(std::exchange(other.slave_, -1)) {}

ConnectedSockets::~ConnectedSockets() {
  for (const int socket : {master_, slave_})
    if (socket >= 0) close(socket);
}

void wait_readable(int descriptor, std::int64_t until_ns) {
  const std::int64_t left_ns = std::max<std::int64_t>(0, until_ns - transport::monotonic_ns());
  pollfd polled{descriptor, POLLIN, 0};
  const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  (void)ppoll(&polled, 1, &left, nullptr);
}

}  // namespace farfeel::bench
