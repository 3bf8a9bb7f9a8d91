#include "tests/support/network_namespaces.h"

namespace farfeel {
namespace {

std::string inside(const std::string& name, int number) {
  const std::string n = std::to_string(number);
  return "ip link set lo up && ip link set " + name + " up && ip address add 10.7.0." + n + "/24 dev " + name +
         " && ip address add 10.7.0.1" + n + "/24 dev " + name + " && ip -6 address add fd07::" + n + "/64 dev " +
         name + " nodad";
}

}  // namespace

tl::expected<NetworkNamespaces, std::string> NetworkNamespaces::make() {
  if (!run_quietly("ip -V")) return tl::unexpected(std::string("there is no program ip (package iproute2)"));
  auto left = NetworkNamespace::make();
  if (!left) return tl::unexpected(left.error());
  auto right = NetworkNamespace::make();
  if (!right) return tl::unexpected(right.error());
  const std::string name = kInterface;
  const std::string there = right->path();
  bool is_made = false;
  left->in([&] {
    // IPv6 addresses would be tentative, and of no use, for the first second: no duplicates can be here.
    is_made =
        run_quietly(
            "sysctl -w net.ipv6.conf.default.accept_dad=0 || echo 0 > /proc/sys/net/ipv6/conf/default/accept_dad") &&
        run_quietly("ip link add " + name + " type veth peer name " + name + " netns " + there) &&
        run_quietly(inside(name, 1));
  });
  right->in([&] {
    is_made = is_made && run_quietly("echo 0 > /proc/sys/net/ipv6/conf/" + name + "/accept_dad") &&
              run_quietly(inside(name, 2));
  });
  if (!is_made) return tl::unexpected(std::string("cannot lay a cable (veth) between two network namespaces"));
  return NetworkNamespaces(std::move(*left), std::move(*right));
}

}  // namespace farfeel
