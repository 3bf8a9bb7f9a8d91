#include "tests/support/network_namespaces.h"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace farfeel {
namespace {

int this_threads_namespace() {
  return open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC);
}

std::string inside(const std::string& name, int number) {
  const std::string n = std::to_string(number);
  return "ip link set lo up && ip link set " + name + " up && ip address add 10.7.0." + n + "/24 dev " + name +
         " && ip address add 10.7.0.1" + n + "/24 dev " + name + " && ip -6 address add fd07::" + n + "/64 dev " +
         name + " nodad";
}

}  // namespace

bool run_quietly(const std::string& command) {
  return std::system(("(" + command + ") >/dev/null 2>&1").c_str()) == 0;
}

tl::expected<NetworkNamespaces, std::string> NetworkNamespaces::make() {
  if (!run_quietly("ip -V")) return tl::unexpected(std::string("there is no program ip (package iproute2)"));
  NetworkNamespaces made;
  made.home_ = this_threads_namespace();
  for (int* const side : {&made.left_, &made.right_}) {
    if (unshare(CLONE_NEWNET) != 0)
      return tl::unexpected(std::string("may not make a network namespace: ") + std::strerror(errno));
    *side = this_threads_namespace();
    if (setns(made.home_, CLONE_NEWNET) != 0) std::abort();  // this thread would be lost to its program
  }
  const std::string name = kInterface;
  const std::string right = "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(made.right_);
  bool is_made = false;
  made.in(Side::kLeft, [&] {
    // IPv6 addresses would be tentative, and of no use, for the first second: no duplicates can be here.
    is_made =
        run_quietly(
            "sysctl -w net.ipv6.conf.default.accept_dad=0 || echo 0 > /proc/sys/net/ipv6/conf/default/accept_dad") &&
        run_quietly("ip link add " + name + " type veth peer name " + name + " netns " + right) &&
        run_quietly(inside(name, 1));
  });
  made.in(Side::kRight, [&] {
    is_made = is_made && run_quietly("echo 0 > /proc/sys/net/ipv6/conf/" + name + "/accept_dad") &&
              run_quietly(inside(name, 2));
  });
  if (!is_made) return tl::unexpected(std::string("cannot lay a cable (veth) between two network namespaces"));
  return made;
}

NetworkNamespaces::NetworkNamespaces(NetworkNamespaces&& other) noexcept
    : home_(std::exchange(other.home_, -1)),
      left_(std::exchange(other.left_, -1)),
      right_(std::exchange(other.right_, -1)) {}

NetworkNamespaces::~NetworkNamespaces() {
  for (const int descriptor : {home_, left_, right_})
    if (descriptor >= 0) close(descriptor);
}

void NetworkNamespaces::in(Side side, const std::function<void()>& work) const {
  if (setns(side == Side::kLeft ? left_ : right_, CLONE_NEWNET) != 0)
    throw std::runtime_error(std::string("cannot go into a network namespace: ") + std::strerror(errno));
  struct Home {
    int descriptor;
    ~Home() {
      if (setns(descriptor, CLONE_NEWNET) != 0) std::abort();
    }
  } const home{home_};
  work();
}

}  // namespace farfeel
