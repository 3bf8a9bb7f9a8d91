#include "master_station/feed/feed_socket.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <vector>

#include "transport/keys/checked_file.h"

namespace farfeel::master_station {
namespace {

constexpr int kBuffer = 32 * 1024;  // of a stopped reader's ticks that is a tenth of a second
constexpr int kMostWaiting = 8;

tl::expected<sockaddr_un, std::string> address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path)
    return tl::unexpected(
        fmt::format("{} is too long a path for a socket: set XDG_RUNTIME_DIR to a shorter one", path));
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

FeedSocket new_socket() {
  return FeedSocket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

bool is_mine(int fd) {
  ucred peer{};
  socklen_t size = sizeof peer;
  return ::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.uid == ::geteuid();
}

std::optional<std::size_t> told(ssize_t done) {
  if (done >= 0) return static_cast<std::size_t>(done);
  if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return 0;
  return std::nullopt;
}

}  // namespace

FeedSocket::~FeedSocket() {
  if (fd_ >= 0) ::close(fd_);
}

std::optional<std::size_t> FeedSocket::send(std::span<const std::byte> bytes) const noexcept {
  return told(::send(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL));
}

std::optional<std::size_t> FeedSocket::receive(std::span<std::byte> into) const noexcept {
  const ssize_t got = ::recv(fd_, into.data(), into.size(), MSG_DONTWAIT);
  return got == 0 ? std::nullopt : told(got);
}

tl::expected<std::string, std::string> feed_path(int pid) {
  const auto folder = transport::make_runtime_folder("views");
  if (!folder) return tl::unexpected(folder.error().message);
  return fmt::format("{}/{}", *folder, pid);
}

tl::expected<FeedSocket, std::string> listen_at(const std::string& path) {
  const auto address = address_of(path);
  if (!address) return tl::unexpected(address.error());
  FeedSocket socket = new_socket();
  ::unlink(path.c_str());
  const mode_t before = ::umask(0177);
  const bool is_bound =
      socket.is_open() && ::bind(socket.fd(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 0;
  ::umask(before);
  if (!is_bound || ::listen(socket.fd(), kMostWaiting) != 0)
    return tl::unexpected(fmt::format("could not listen at {}: {}", path, std::strerror(errno)));
  return socket;
}

std::optional<FeedSocket> accepted(const FeedSocket& listening) noexcept {
  FeedSocket socket(::accept4(listening.fd(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (!socket.is_open() || !is_mine(socket.fd())) return std::nullopt;
  ::setsockopt(socket.fd(), SOL_SOCKET, SO_SNDBUF, &kBuffer, sizeof kBuffer);
  return socket;
}

tl::expected<FeedSocket, std::string> connect_to_feed(int pid) {
  std::vector<std::string> paths;
  const auto path = feed_path(pid);
  if (!path) return tl::unexpected(path.error());
  if (pid > 0) {
    paths.push_back(*path);
  } else {
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(*path).parent_path(), ignored))
      paths.push_back(entry.path().string());
  }
  std::vector<FeedSocket> live;
  for (const std::string& at : paths) {
    const auto address = address_of(at);
    if (!address) return tl::unexpected(address.error());
    FeedSocket socket = new_socket();
    if (::connect(socket.fd(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 0 &&
        is_mine(socket.fd()))
      live.push_back(std::move(socket));
    else if (pid == 0 && errno == ECONNREFUSED)
      ::unlink(at.c_str());  // its master is gone
  }
  if (live.empty())
    return tl::unexpected(pid > 0
                              ? fmt::format("no session of process {} can be looked at", pid)
                              : std::string("no session runs here: start one, for example with 'farfeel loopback'"));
  if (live.size() > 1)
    return tl::unexpected(
        fmt::format("{} sessions run here: say which with --session and its master's process number", live.size()));
  return std::move(live.front());
}

}  // namespace farfeel::master_station
