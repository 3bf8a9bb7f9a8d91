#include "transport/confine/privileges.h"

#include <fmt/format.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <pwd.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "tests/support/in_child.h"

namespace farfeel::transport {
namespace {

using test_support::in_child;

constexpr const char* kSomebody = "nobody";  // every Debian has this user

/// The lines of /proc/self/status that tell of privileges.
std::string standing() {
  std::string all;
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);) {
    for (const char* name : {"CapInh:", "CapPrm:", "CapEff:", "CapBnd:", "CapAmb:", "NoNewPrivs:", "Groups:"})
      if (line.starts_with(name)) all += line + "\n";
  }
  return all;
}
bool has_no_privilege(const std::string& standing) {
  for (const char* name : {"CapInh", "CapPrm", "CapEff", "CapAmb"})
    if (standing.find(fmt::format("{}:\t0000000000000000\n", name)) == std::string::npos) return false;
  return standing.find("NoNewPrivs:\t1\n") != std::string::npos;
}
std::string dropped(const std::string& user, const std::function<std::string()>& then) {
  return in_child([&] {
           const auto words = drop_privileges(user);
           return words ? then() : words.error();
         })
      .words;
}

class PrivilegesTest : public testing::Test {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "only root has privileges to lose";
    const passwd* entry = ::getpwnam(kSomebody);
    if (entry == nullptr) GTEST_SKIP() << "there is no user " << kSomebody;
    uid_ = entry->pw_uid;
    const auto may = in_child(
        [&] { return std::string(::setgroups(0, nullptr) == 0 && ::setuid(uid_) == 0 ? "yes" : ::strerror(errno)); });
    if (may.words != "yes") GTEST_SKIP() << "root may not become somebody else here: " << may.words;
    ::unsetenv("SUDO_UID");
  }
  uid_t uid_ = 0;
};

TEST_F(PrivilegesTest, AreGoneForWhomeverRootBecomes) {
  EXPECT_TRUE(has_no_privilege(dropped(kSomebody, standing))) << dropped(kSomebody, standing);
  EXPECT_EQ(dropped(kSomebody,
                    [&] {
                      return fmt::format("{} {} {}", ::getuid() == uid_, ::setuid(0) != 0,
                                         ::access("/etc/shadow", R_OK) != 0);
                    }),
            "true true true");
  EXPECT_NE(dropped(kSomebody, standing).find("CapBnd:\t0000000000000000\n"), std::string::npos);
  EXPECT_EQ(dropped(kSomebody, [] { return std::string(::getenv("USER")); }), kSomebody);
}

TEST_F(PrivilegesTest, AreGoneForRootWhoStaysRoot) {
  for (const char* user : {"", "root"}) {
    EXPECT_TRUE(has_no_privilege(dropped(user, standing))) << dropped(user, standing);
    EXPECT_EQ(dropped(user,
                      [&] {
                        const bool is_root = ::getuid() == 0;
                        return fmt::format("{} {} {}", is_root, ::chroot("/tmp") != 0, ::setuid(uid_) != 0);
                      }),
              "true true true");
  }
}

TEST_F(PrivilegesTest, GoToWhoCalledSudo) {
  const auto under_sudo = [&](const std::string& uid, const std::string& wish) {
    return in_child([&] {
             ::setenv("SUDO_UID", uid.c_str(), 1);
             const auto words = drop_privileges(wish);
             return words ? std::to_string(::getuid()) : words.error();
           })
        .words;
  };
  EXPECT_EQ(under_sudo(std::to_string(uid_), ""), std::to_string(uid_));
  EXPECT_EQ(under_sudo(std::to_string(uid_), "root"), "0");
  EXPECT_EQ(under_sudo("0", ""), "0");
  EXPECT_EQ(under_sudo("no number", ""), "0");
  EXPECT_NE(under_sudo("4000123", "").find("does not know"), std::string::npos);
}

TEST_F(PrivilegesTest, AreNotGivenByAWishAlone) {
  EXPECT_NE(dropped("no-such-user", standing).find("no user 'no-such-user'"), std::string::npos);
  const auto as_somebody = [&](const std::string& wish) {
    return in_child([&] {
             if (::setgroups(0, nullptr) != 0 || ::setuid(uid_) != 0) return std::string("cannot become somebody");
             const auto words = drop_privileges(wish);
             return words ? standing() : words.error();
           })
        .words;
  };
  EXPECT_TRUE(has_no_privilege(as_somebody("")));
  EXPECT_TRUE(has_no_privilege(as_somebody(kSomebody)));
  EXPECT_NE(as_somebody("root").find("only root can become 'root'"), std::string::npos);
}

TEST_F(PrivilegesTest, EndWithTheParentStill) {
  EXPECT_EQ(in_child([&] {
              (void)prctl(PR_SET_PDEATHSIG, SIGTERM, 0, 0, 0);
              if (!drop_privileges(kSomebody)) return std::string("not dropped");
              int signal = 0;
              (void)prctl(PR_GET_PDEATHSIG, &signal, 0, 0, 0);
              return std::to_string(signal);
            }).words,
            std::to_string(SIGTERM));
}

// Why they go before the first bind: the port's group is the user's who bound it first.
TEST_F(PrivilegesTest, ThatAreGoneKeepOtherUsersOutOfThePortsGroup) {
  const auto bound = [](in_port_t& port) {
    const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0), on = 1;
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = port;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    (void)::setsockopt(fd, SOL_SOCKET, SO_REUSEPORT, &on, sizeof on);
    if (::bind(fd, reinterpret_cast<sockaddr*>(&at), size) != 0) return false;
    (void)::getsockname(fd, reinterpret_cast<sockaddr*>(&at), &size);
    port = at.sin_port;
    return true;
  };
  EXPECT_EQ(dropped(kSomebody,
                    [&] {
                      in_port_t port = 0;
                      if (!bound(port)) return std::string("no port");
                      return std::string(bound(port) ? "joined" : "refused");
                    }),
            "joined");
  // Root binds first here, and somebody, who is confined, cannot join.
  in_port_t port = 0;
  ASSERT_TRUE(bound(port));
  EXPECT_EQ(dropped(kSomebody, [&] { return std::string(bound(port) ? "joined" : "refused"); }), "refused");
}

}  // namespace
}  // namespace farfeel::transport
