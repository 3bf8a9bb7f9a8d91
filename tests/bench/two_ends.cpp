#include "tests/bench/two_ends.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

namespace farfeel::bench {
namespace {

bool write_file(const char* path, const std::string& text) {
  const int file = open(path, O_WRONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool is_written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  close(file);
  return is_written;
}

// user_namespaces(7): who makes one has every capability in it, once his id is mapped to root's. The network namespace
// that it is at home in must belong to it, or it could not come back there.
void become_root_of_own_namespace() {
  const uid_t user = geteuid();
  const gid_t group = getegid();
  if (user == 0 || unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return;
  write_file("/proc/self/setgroups", "deny");
  write_file("/proc/self/uid_map", fmt::format("0 {} 1", user));
  write_file("/proc/self/gid_map", fmt::format("0 {} 1", group));
  (void)run_quietly("ip link set lo up");
}

}  // namespace

TwoEnds::TwoEnds() {
  become_root_of_own_namespace();
  auto made = NetworkNamespaces::make();
  if (!made) {
    reason_ = made.error();
    return;
  }
  spaces_.emplace(std::move(*made));
  go_by(*transport::parse_address("10.7.0.1", 0), *transport::parse_address("10.7.0.2", 0));
}

void TwoEnds::in(End end, const std::function<void()>& work) const {
  if (!spaces_) return work();
  spaces_->in(end == End::kMaster ? NetworkNamespaces::Side::kLeft : NetworkNamespaces::Side::kRight, work);
}

}  // namespace farfeel::bench
