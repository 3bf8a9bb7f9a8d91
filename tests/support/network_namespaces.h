// Two machines on one: a pair of network namespaces with a cable (veth) between them.
//
//   left  10.7.0.1, 10.7.0.11, fd07::1, fe80::...  ════  right  10.7.0.2, 10.7.0.12, fd07::2, fe80::...
#pragma once

#include <functional>
#include <string>
#include <tl/expected.hpp>

namespace farfeel {

/// Gone with this object and the sockets in it. Needs root (CAP_SYS_ADMIN) and the program `ip`.
class NetworkNamespaces {
 public:
  /// Fails with a reason to skip by.
  [[nodiscard]] static tl::expected<NetworkNamespaces, std::string> make();
  NetworkNamespaces(NetworkNamespaces&& other) noexcept;
  NetworkNamespaces& operator=(NetworkNamespaces&&) = delete;
  ~NetworkNamespaces();

  enum class Side { kLeft, kRight };
  /// Runs work on this thread, inside a side; sockets that it opens stay there for good, wherever they are used from.
  /// Threads and processes that it starts are inside, too. Not to be nested. Throws std::runtime_error
  /// if it cannot go there.
  void in(Side, const std::function<void()>& work) const;
  /// "cable", the name of the interface at both sides, for scope ids and for `tc`.
  static constexpr const char* kInterface = "cable";

 private:
  NetworkNamespaces() = default;
  int home_ = -1, left_ = -1, right_ = -1;  // namespaces, as open files
};

/// Runs a shell command, output discarded; whether it succeeded.
bool run_quietly(const std::string& command);

}  // namespace farfeel
