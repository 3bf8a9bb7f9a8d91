#include "transport/confine/privileges.h"

#include <fmt/format.h>
#include <grp.h>
#include <linux/capability.h>
#include <pwd.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string_view>

namespace farfeel::transport {
namespace {

using Result = tl::expected<void, std::string>;

tl::unexpected<std::string> cannot(const std::string& what) {
  return tl::unexpected(fmt::format("cannot {}: {}", what, std::strerror(errno)));
}

struct User {
  std::string name, home;
  uid_t uid;
  gid_t gid;
};
std::optional<User> as_user(const passwd* entry) {
  if (entry == nullptr) return std::nullopt;
  return User{entry->pw_name, entry->pw_dir, entry->pw_uid, entry->pw_gid};
}

/// SUDO_UID, where it is a user's number.
std::optional<uid_t> who_called_sudo() {
  const char* text = std::getenv("SUDO_UID");
  if (text == nullptr) return std::nullopt;
  const std::string_view digits = text;
  uid_t uid = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), uid);
  if (error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  return uid;
}

/// Who root is to become; nothing: stay.
tl::expected<std::optional<User>, std::string> successor(const std::string& wish) {
  std::optional<User> user;
  if (!wish.empty()) {
    user = as_user(getpwnam(wish.c_str()));
    if (!user) return tl::unexpected(fmt::format("there is no user '{}' on this machine", wish));
  } else if (getuid() != 0) {
    user = as_user(getpwuid(getuid()));
  } else if (const auto caller = who_called_sudo()) {
    user = as_user(getpwuid(*caller));
    if (!user)
      return tl::unexpected(fmt::format("sudo was called by user {}, whom this machine does not know", *caller));
  }
  if (user && user->uid == 0) user.reset();
  return user;
}

Result become(const User& user) {
  int end_with_parent = 0;  // the signal that comes when whoever started this dies; forgotten with the old user
  (void)prctl(PR_GET_PDEATHSIG, &end_with_parent, 0, 0, 0);
  if (initgroups(user.name.c_str(), user.gid) != 0) return cannot(fmt::format("take the groups of {}", user.name));
  if (setresgid(user.gid, user.gid, user.gid) != 0) return cannot(fmt::format("take the group of {}", user.name));
  if (setresuid(user.uid, user.uid, user.uid) != 0) return cannot(fmt::format("become {}", user.name));
  if (setuid(0) == 0) return tl::unexpected(std::string("the way back to root is still open"));
  (void)prctl(PR_SET_PDEATHSIG, static_cast<unsigned long>(end_with_parent), 0, 0, 0);
  setenv("HOME", user.home.c_str(), 1);
  setenv("USER", user.name.c_str(), 1);
  setenv("LOGNAME", user.name.c_str(), 1);
  for (const char* folder : {"XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME", "XDG_RUNTIME_DIR"}) unsetenv(folder);
  return {};
}

using Capabilities = std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3>;
Result drop_capabilities() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  Capabilities none{};
  (void)prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0);  // empty with the others, on any kernel since 4.3
  if (syscall(SYS_capset, &header, none.data()) != 0) return cannot("give up capabilities");
  Capabilities left{};
  if (syscall(SYS_capget, &header, left.data()) != 0) return cannot("look at the capabilities that are left");
  for (const auto& word : left) {
    if (word.effective != 0 || word.permitted != 0 || word.inheritable != 0)
      return tl::unexpected(std::string("there are capabilities left"));
  }
  return {};
}

/// What no program that this one would start could have. Needs CAP_SETPCAP; without it there is little to lose.
void drop_bounding_set() {
  for (unsigned long capability = 0; prctl(PR_CAPBSET_READ, capability, 0, 0, 0) >= 0; ++capability)
    (void)prctl(PR_CAPBSET_DROP, capability, 0, 0, 0);
}

}  // namespace

tl::expected<std::string, std::string> drop_privileges(const std::string& user) {
  std::string words = "runs without any privilege";
  if (geteuid() == 0) {
    const auto next = successor(user);
    if (!next) return tl::unexpected(next.error());
    drop_bounding_set();
    if (*next) {
      if (const auto done = become(**next); !done) return tl::unexpected(done.error());
      words = fmt::format("runs as {}, without any privilege", (*next)->name);
    } else {
      // Not everywhere may root change its groups: in a user namespace it may not.
      const bool has_groups = setgroups(0, nullptr) != 0 && getgroups(0, nullptr) > 0;
      words = fmt::format("runs as root without a capability{}; --user NAME lets it run as somebody else",
                          has_groups ? ", but with root's groups" : "");
    }
  } else if (const auto named = user.empty() ? std::nullopt : as_user(getpwnam(user.c_str()));
             !user.empty() && (!named || named->uid != geteuid())) {
    return tl::unexpected(fmt::format("only root can become '{}'", user));
  }
  if (const auto done = drop_capabilities(); !done) return tl::unexpected(done.error());
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return cannot("renounce new privileges");
  return words;
}

}  // namespace farfeel::transport
