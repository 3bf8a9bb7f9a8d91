// Machines on an Internet that this process plays: each is a network namespace with one interface (TUN), whose other
// end is here; between them are a delay and NATs of every kind (simulated_nats.h). The machines' own side of it all,
// from sockets down to IPv4 packets, is the kernel's, and so real programs run there. UDP over IPv4 is carried and
// nothing else.
//
// Where kernels have netem and a user's tools have nftables, those would do; many have neither.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <tl/expected.hpp>
#include <vector>

#include "tests/support/network_namespace.h"
#include "tests/support/simulated_nats.h"

namespace farfeel {

class SimulatedInternet {
 public:
  /// Needs root (CAP_SYS_ADMIN, CAP_NET_ADMIN), /dev/net/tun and the program `ip`. Fails with a reason to skip by.
  [[nodiscard]] static tl::expected<std::unique_ptr<SimulatedInternet>, std::string> make(std::size_t machines,
                                                                                          std::int64_t one_way_ns);
  ~SimulatedInternet();
  SimulatedInternet(const SimulatedInternet&) = delete;
  SimulatedInternet& operator=(const SimulatedInternet&) = delete;

  struct BehindNat {
    std::string outer;  ///< the NAT's address
    transport::NatKind kind;
  };
  /// The machine has this address from now on, in place of any before: public, or a NAT's inside. IPv4 in dots.
  [[nodiscard]] bool place(std::size_t machine, const std::string& address, const std::optional<BehindNat>& nat = {});
  /// As NetworkNamespace::in.
  void in(std::size_t machine, const std::function<void()>& work) const { machines_[machine].space.in(work); }
  /// Whether what goes from behind one NAT to behind another is lost from now on.
  void block_direct_ways(bool is_blocked);
  /// Datagrams that went from behind one NAT to behind another, and so past any relay.
  [[nodiscard]] std::size_t passed_two_nats();

 private:
  struct Machine {
    NetworkNamespace space;
    int tun;
  };
  SimulatedInternet(std::vector<Machine> machines, std::int64_t one_way_ns);
  void run(const std::stop_token&);
  void take_packets(int tun);

  std::vector<Machine> machines_;
  std::mutex mutex_;
  transport::SimulatedNats nats_;  // at the mutex; on CLOCK_MONOTONIC
  std::jthread thread_;            // last: it ends before what it uses
};

}  // namespace farfeel
