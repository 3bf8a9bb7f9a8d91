// A machine of its own for the network's part: a network namespace.
#pragma once

#include <functional>
#include <string>
#include <tl/expected.hpp>

namespace farfeel {

/// Gone with this object and the sockets in it. Needs root (CAP_SYS_ADMIN).
class NetworkNamespace {
 public:
  /// Fails with a reason to skip by. Its loopback interface is down.
  [[nodiscard]] static tl::expected<NetworkNamespace, std::string> make();
  NetworkNamespace(NetworkNamespace&& other) noexcept;
  NetworkNamespace& operator=(NetworkNamespace&&) = delete;
  ~NetworkNamespace();

  /// Runs work on this thread, inside; sockets that it opens stay there for good, wherever they are used from. Threads
  /// and processes that it starts are inside, too. Not to be nested. Throws std::runtime_error if it cannot go there.
  void in(const std::function<void()>& work) const;
  /// A path that names it, for `ip ... netns`.
  [[nodiscard]] std::string path() const;

 private:
  NetworkNamespace() = default;
  int home_ = -1, inside_ = -1;  // namespaces, as open files
};

/// Runs a shell command, output discarded; whether it succeeded.
bool run_quietly(const std::string& command);

}  // namespace farfeel
