#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <thread>
#include <vector>

#include "haptic_core/realtime/periodic_loop.h"
#include "tests/bench/bulk_method.h"
#include "transport/net/socket_address.h"

namespace farfeel::bench {
namespace {

constexpr int kNap_ms = 5, kConnect_ms = 3000;
constexpr std::size_t kChunk = 65'536;

sockaddr* generic(sockaddr_storage& storage) {
  return reinterpret_cast<sockaddr*>(&storage);
}

/// Closes by a reset: nothing of it lives on in the link.
void abandon(int socket) {
  if (socket < 0) return;
  const linger at_once{1, 0};
  (void)setsockopt(socket, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  close(socket);
}

class Tcp final : public BulkTransfer {
 public:
  ~Tcp() override {
    is_over_ = true;
    if (writer_.joinable()) writer_.join();
    if (reader_.joinable()) reader_.join();
    for (const int socket : {from_, to_, listener_}) abandon(socket);
  }
  /// Empty, or what went wrong.
  std::string connect(const TwoEnds& ends, const std::string& congestion_control) {
    std::string failed;
    const auto check = [&](bool is_good, const char* what) {
      if (!is_good && failed.empty()) failed = fmt::format("{}: {}", what, std::strerror(errno));
    };
    sockaddr_storage local{};
    socklen_t size = transport::to_sockaddr(ends.address(TwoEnds::End::kSlave), local);
    ends.in(TwoEnds::End::kSlave, [&] {
      listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      check(setsockopt(listener_, IPPROTO_TCP, TCP_CONGESTION, congestion_control.data(),
                       static_cast<socklen_t>(congestion_control.size())) == 0,
            "this kernel's TCP has no such congestion control, or lets nobody choose it here");
      check(bind(listener_, generic(local), size) == 0 && listen(listener_, 1) == 0 &&
                getsockname(listener_, generic(local), &size) == 0,
            "cannot listen");
    });
    if (!failed.empty()) return failed;
    ends.in(TwoEnds::End::kMaster, [&] {
      to_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
      check(::connect(to_, generic(local), size) == 0 || errno == EINPROGRESS, "cannot connect");
    });
    pollfd polled{listener_, POLLIN, 0};
    if (failed.empty() && poll(&polled, 1, kConnect_ms) == 1)
      from_ = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (from_ < 0) return failed.empty() ? "no connection within 3 s" : failed;
    writer_ = std::thread([this] { write_all(); });
    reader_ = std::thread([this] { read_all(); });
    return {};
  }
  std::uint64_t arrived_bytes() const override { return arrived_.load(); }

 private:
  void write_all() {
    (void)realtime::use_fifo(kBulkFifoPriority);
    const std::vector<char> chunk(kChunk, 'x');
    while (!is_over_.load(std::memory_order_relaxed)) {
      pollfd polled{from_, POLLOUT, 0};
      if (poll(&polled, 1, kNap_ms) == 1 && ::send(from_, chunk.data(), chunk.size(), MSG_NOSIGNAL) < 0 &&
          errno != EAGAIN)
        return;
    }
  }
  void read_all() {
    (void)realtime::use_fifo(kBulkFifoPriority);
    std::vector<char> chunk(kChunk);
    while (!is_over_.load(std::memory_order_relaxed)) {
      pollfd polled{to_, POLLIN, 0};
      if (poll(&polled, 1, kNap_ms) != 1) continue;
      const ssize_t size = recv(to_, chunk.data(), chunk.size(), 0);
      if (size > 0) arrived_.fetch_add(static_cast<std::uint64_t>(size));
      if (size == 0 || (size < 0 && errno != EAGAIN)) return;
    }
  }

  int listener_ = -1, from_ = -1, to_ = -1;
  std::atomic<bool> is_over_{false};
  std::atomic<std::uint64_t> arrived_{0};
  std::thread writer_, reader_;
};

}  // namespace

MadeTransfer begin_tcp(const TwoEnds& ends, const std::string& congestion_control) {
  auto tcp = std::make_unique<Tcp>();
  if (const std::string failed = tcp->connect(ends, congestion_control); !failed.empty()) return tl::unexpected(failed);
  return tcp;
}

}  // namespace farfeel::bench
