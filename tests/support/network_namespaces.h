// Two machines on one: a pair of network namespaces with a cable (veth) between them.
//
//   left  10.7.0.1, 10.7.0.11, fd07::1, fe80::...  ════  right  10.7.0.2, 10.7.0.12, fd07::2, fe80::...
#pragma once

#include <functional>
#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "tests/support/network_namespace.h"

namespace farfeel {

/// Needs root (CAP_SYS_ADMIN) and the program `ip`.
class NetworkNamespaces {
 public:
  /// Fails with a reason to skip by.
  [[nodiscard]] static tl::expected<NetworkNamespaces, std::string> make();

  enum class Side { kLeft, kRight };
  /// As NetworkNamespace::in.
  void in(Side side, const std::function<void()>& work) const { (side == Side::kLeft ? left_ : right_).in(work); }
  /// "cable", the name of the interface at both sides, for scope ids and for `tc`.
  static constexpr const char* kInterface = "cable";

 private:
  NetworkNamespaces(NetworkNamespace left, NetworkNamespace right) : left_(std::move(left)), right_(std::move(right)) {}
  NetworkNamespace left_, right_;
};

}  // namespace farfeel
