// The road between a master and a slave, whose faults are made while both go on: cut, slow, lossy, narrow; and the
// client's address, which changes as behind a carrier's translator.
//
// One port in front for both lanes, and a socket of its own for each lane towards the slave. A thread of its own; every
// change is done when the call returns, and the call says when.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "tests/end_to_end/faults/yardstick.h"
#include "transport/link/impairment.h"
#include "transport/net/udp_socket.h"
#include "transport/net/wait_set.h"
#include "transport/seal/handshake_messages.h"

namespace farfeel::end_to_end {

class FaultRelay {
 public:
  FaultRelay(const transport::Address& slave, std::uint64_t seed);
  ~FaultRelay();
  FaultRelay(const FaultRelay&) = delete;
  FaultRelay& operator=(const FaultRelay&) = delete;

  [[nodiscard]] const transport::Address& local() const { return local_; }
  [[nodiscard]] Lateness& lateness() { return lateness_; }  ///< of datagrams, as they leave

  // Each returns the time from which on it holds (CLOCK_MONOTONIC).
  /// Of both lanes, both ways. What is under way arrives as it would have.
  std::int64_t set_link(const transport::LinkSpec& spec);
  enum Way : std::size_t { kUp, kDown };
  /// What comes while a way is cut, or is under way then, is gone.
  std::int64_t cut(transport::LaneKind lane, Way way, bool is_cut);
  std::int64_t cut_all(bool is_cut);
  /// Longer datagrams vanish, without a word.
  std::int64_t set_most_bytes(std::size_t bytes);
  /// The lane's client has another address from now on; what is under way to the old one is gone.
  std::int64_t rebind(transport::LaneKind lane);

 private:
  struct Lane {
    std::optional<transport::UdpSocket> to_slave;
    std::optional<transport::Address> master;
    std::array<transport::Impairment, 2> impairments;
    std::array<bool, 2> is_cut{};
    std::array<std::int64_t, 2> newest_ns{};  // arrivals; two sockets are read one after the other
    std::multimap<std::int64_t, std::pair<Way, std::vector<std::byte>>> under_way;  // by when they leave
  };
  void run();
  void take_arrivals();
  void take(Lane&, Way, const transport::Received&);
  void release_due();
  [[nodiscard]] std::int64_t next_release_ns() const;
  template <typename Change>
  std::int64_t change(const Change&);

  transport::Address slave_;
  transport::UdpSocket front_;
  transport::Address local_;
  transport::WakeEvent wake_;
  std::uint64_t seed_;
  std::mutex mutex_;  // of all below
  std::array<Lane, 2> lanes_;
  std::size_t most_bytes_ = 65535;
  Lateness lateness_;
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

}  // namespace farfeel::end_to_end
