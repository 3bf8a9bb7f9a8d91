// Where the two ends of a link bench are: in two network namespaces with a cable between them, or both on loopback.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "tests/support/network_namespaces.h"
#include "transport/net/address.h"

namespace farfeel::bench {

class TwoEnds {
 public:
  enum class End : std::uint8_t { kMaster, kSlave };

  /// Who is not root becomes root of a user namespace of its own for this, where the kernel lets him: call it before
  /// any other thread runs.
  TwoEnds();

  [[nodiscard]] bool has_cable() const { return spaces_.has_value(); }
  /// Why there is no cable; empty if there is one.
  [[nodiscard]] const std::string& reason() const { return reason_; }
  [[nodiscard]] std::string over() const { return has_cable() ? "veth" : "loopback"; }
  /// Runs work where that end's sockets are to be opened; they stay there, whichever thread uses them.
  void in(End, const std::function<void()>& work) const;
  /// Of an end, port 0: the cable's, unless others were told.
  [[nodiscard]] transport::Address address(End end) const { return end == End::kMaster ? master_ : slave_; }
  void go_by(const transport::Address& master, const transport::Address& slave) { master_ = master, slave_ = slave; }

 private:
  std::optional<NetworkNamespaces> spaces_;
  std::string reason_;
  transport::Address master_ = transport::loopback(), slave_ = transport::loopback();
};

}  // namespace farfeel::bench
