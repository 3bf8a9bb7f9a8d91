// The local socket between a master and whoever looks at its session: $XDG_RUNTIME_DIR/farfeel/views/PID, mode 0600, in
// a folder that only its user may enter, and asked for its peer's user on top.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace farfeel::master_station {

/// A descriptor of a socket that never waits. Closes itself.
class FeedSocket {
 public:
  explicit FeedSocket(int fd = -1) noexcept : fd_(fd) {}
  FeedSocket(FeedSocket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FeedSocket& operator=(FeedSocket&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~FeedSocket();

  /// How many bytes were taken, perhaps none; nothing once the other end is gone.
  [[nodiscard]] std::optional<std::size_t> send(std::span<const std::byte> bytes) const noexcept;
  /// How many bytes came, perhaps none; nothing once the other end is gone.
  [[nodiscard]] std::optional<std::size_t> receive(std::span<std::byte> into) const noexcept;
  [[nodiscard]] bool is_open() const noexcept { return fd_ >= 0; }
  [[nodiscard]] int fd() const noexcept { return fd_; }

 private:
  int fd_;
};

/// Where the master with that process number listens, whether it is there or not.
[[nodiscard]] tl::expected<std::string, std::string> feed_path(int pid);
/// At feed_path() of this process; what an earlier one left there is removed.
[[nodiscard]] tl::expected<FeedSocket, std::string> listen_at(const std::string& path);
/// The next one that wants to look, of this user; nothing where nobody does.
[[nodiscard]] std::optional<FeedSocket> accepted(const FeedSocket& listening) noexcept;
/// pid 0: the one master that runs here; an error where there is none, or several.
[[nodiscard]] tl::expected<FeedSocket, std::string> connect_to_feed(int pid);

}  // namespace farfeel::master_station
