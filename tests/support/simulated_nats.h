// A network on a clock that is given: hosts on the public Internet, and hosts behind NATs of every kind (RFC 4787).
//
//   10.0.0.1 ── NAT 203.0.113.1 ──┐
//                                 ├── public hosts
//   10.0.0.2 ── NAT 203.0.113.2 ──┘
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "transport/net/address.h"

namespace farfeel::transport {

/// What of the remote address a NAT looks at.
enum class Looks : std::uint8_t { kNowhere, kAtHost, kAtHostAndPort };
struct NatKind {
  Looks mapping = Looks::kNowhere;          ///< one outer port for all remotes, or one for each
  Looks filtering = Looks::kAtHostAndPort;  ///< which remotes may answer to an outer port
};

class SimulatedNats {
 public:
  using Bytes = std::vector<std::byte>;
  using Handler = std::function<void(const Address& from, const Address& to, std::span<const std::byte>)>;
  std::int64_t delay_ns = 20'000'000;  ///< one way, whether through NATs or not

  // Of addresses of hosts and NATs the port counts for nothing: a host has them all.
  void add_host(const Address& host, Handler handler) { hosts_[to_bytes(host.with_port(0))] = std::move(handler); }
  /// host is reached through a NAT with this outer address. What was its NAT before is gone.
  void add_nat(const Address& host, const Address& outer, NatKind kind) {
    std::erase_if(nats_, [&](const Nat& nat) { return nat.host.has_ip_of(host); });
    nats_.push_back({host, outer, kind, {}, {}});
  }
  /// Mappings are gone, as after a restart: the same socket gets another outer port.
  void forget_mappings() {
    for (Nat& nat : nats_) {
      nat.ports.clear();
      nat.opened.clear();
    }
  }
  bool direct_is_blocked = false;  ///< what passes two NATs is lost
  std::size_t passed_two_nats = 0;

  void send(const Address& from, const Address& to, std::span<const std::byte> bytes) {
    Address source = from;
    bool is_behind_nat = false;
    for (Nat& nat : nats_) {
      if (!nat.host.has_ip_of(from)) continue;
      is_behind_nat = true;
      const auto [mapped, is_new] = nat.ports.try_emplace({from.port, seen(nat.kind.mapping, to)}, nat.next_port);
      if (is_new) nat.next_port += 7;
      source = nat.outer.with_port(mapped->second);
      nat.opened.insert({mapped->second, seen(nat.kind.filtering, to)});
    }
    for (const Nat& nat : nats_) {
      if (!nat.outer.has_ip_of(to)) continue;
      if (is_behind_nat && direct_is_blocked) return;
      const auto mapped =
          std::find_if(nat.ports.begin(), nat.ports.end(), [&](const auto& entry) { return entry.second == to.port; });
      if (mapped == nat.ports.end() ||
          (nat.kind.filtering != Looks::kNowhere && !nat.opened.contains({to.port, seen(nat.kind.filtering, source)})))
        return;
      passed_two_nats += is_behind_nat;
      return deliver(source, nat.host.with_port(mapped->first.first), bytes);
    }
    deliver(source, to, bytes);
  }

  [[nodiscard]] std::int64_t now_ns() const { return now_ns_; }
  /// When run_until() has something to deliver.
  [[nodiscard]] std::int64_t next_ns() const {
    return flying_.empty() ? std::numeric_limits<std::int64_t>::max() : flying_.top().time_ns;
  }
  /// Delivers all until then.
  void run_until(std::int64_t time_ns) {
    while (!flying_.empty() && flying_.top().time_ns <= time_ns) {
      const Flying next = flying_.top();
      flying_.pop();
      now_ns_ = next.time_ns;
      if (const auto host = hosts_.find(to_bytes(next.to.with_port(0))); host != hosts_.end())
        host->second(next.from, next.to, next.bytes);
    }
    now_ns_ = time_ns;
  }

 private:
  struct Nat {
    Address host, outer;
    NatKind kind;
    std::map<std::pair<std::uint16_t, AddressBytes>, std::uint16_t> ports;  // by inner port and what the mapping sees
    std::set<std::pair<std::uint16_t, AddressBytes>> opened;                // outer port, what the filter looks at
    std::uint16_t next_port = 40000;
  };
  struct Flying {
    std::int64_t time_ns;
    std::uint64_t order;
    Address from, to;
    Bytes bytes;
    bool operator<(const Flying& b) const { return std::tie(b.time_ns, b.order) < std::tie(time_ns, order); }
  };
  static AddressBytes seen(Looks looks, const Address& remote) {
    return to_bytes(looks == Looks::kNowhere ? Address{} : looks == Looks::kAtHost ? remote.with_port(0) : remote);
  }
  void deliver(const Address& from, const Address& to, std::span<const std::byte> bytes) {
    flying_.push({now_ns_ + delay_ns, ++order_, from, to, Bytes(bytes.begin(), bytes.end())});
  }

  std::int64_t now_ns_ = 1'000'000'000'000;
  std::uint64_t order_ = 0;
  std::map<AddressBytes, Handler> hosts_;
  std::vector<Nat> nats_;
  std::priority_queue<Flying> flying_;
};

}  // namespace farfeel::transport
