#include "tests/support/network_namespace.h"

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

}  // namespace

bool run_quietly(const std::string& command) {
  return std::system(("(" + command + ") >/dev/null 2>&1").c_str()) == 0;
}

tl::expected<NetworkNamespace, std::string> NetworkNamespace::make() {
  NetworkNamespace made;
  made.home_ = this_threads_namespace();
  if (unshare(CLONE_NEWNET) != 0)
    return tl::unexpected(std::string("may not make a network namespace: ") + std::strerror(errno));
  made.inside_ = this_threads_namespace();
  if (setns(made.home_, CLONE_NEWNET) != 0) std::abort();  // this thread would be lost to its program
  return made;
}

NetworkNamespace::NetworkNamespace(NetworkNamespace&& other) noexcept
    : home_(std::exchange(other.home_, -1)), inside_(std::exchange(other.inside_, -1)) {}

NetworkNamespace::~NetworkNamespace() {
  for (const int descriptor : {home_, inside_})
    if (descriptor >= 0) close(descriptor);
}

void NetworkNamespace::in(const std::function<void()>& work) const {
  if (setns(inside_, CLONE_NEWNET) != 0)
    throw std::runtime_error(std::string("cannot go into a network namespace: ") + std::strerror(errno));
  struct Home {
    int descriptor;
    ~Home() {
      if (setns(descriptor, CLONE_NEWNET) != 0) std::abort();
    }
  } const home{home_};
  work();
}

std::string NetworkNamespace::path() const {
  return "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(inside_);
}

}  // namespace farfeel
