// The kernel's interface is three system calls; Debian 12's C library has no functions for them, and its header knows
// versions 1 and 2. Later versions only add: rights are masked by the version that the kernel says it has.

#include "transport/confine/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/landlock.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

namespace farfeel::transport {
namespace {

// As later headers have them.
constexpr std::uint64_t kTruncate = 1u << 14;                                  // version 3
constexpr std::uint64_t kIoctlDevice = 1u << 15;                               // version 5
constexpr std::uint64_t kBindTcp = 1u << 0, kConnectTcp = 1u << 1;             // version 4
constexpr std::uint64_t kScopeAbstractUnix = 1u << 0, kScopeSignal = 1u << 1;  // version 6
struct RulesetAttributes {
  std::uint64_t handled_access_fs, handled_access_net, scoped;
};

constexpr std::uint64_t kReadFile = LANDLOCK_ACCESS_FS_READ_FILE;
constexpr std::uint64_t kRead = kReadFile | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t kWrite = kRead | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_REMOVE_DIR |
                                 LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_MAKE_DIR |
                                 LANDLOCK_ACCESS_FS_MAKE_REG | kTruncate;
constexpr std::uint64_t kUse = kRead | LANDLOCK_ACCESS_FS_WRITE_FILE | kIoctlDevice;
/// Those that a file, as against a folder, can have.
constexpr std::uint64_t kOfFiles =
    kReadFile | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_EXECUTE | kTruncate | kIoctlDevice;

constexpr std::uint64_t all_of(int version) {
  std::uint64_t all = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1;  // version 1: bits 0 to 12
  if (version >= 2) all |= LANDLOCK_ACCESS_FS_REFER;
  if (version >= 3) all |= kTruncate;
  if (version >= 5) all |= kIoctlDevice;
  return all;
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

tl::unexpected<std::string> cannot(const std::string& what) {
  return tl::unexpected(fmt::format("Landlock: cannot {}: {}", what, std::strerror(errno)));
}

/// False with errno where the rule was refused; a path that is not there is none.
bool allow(int ruleset, const std::string& path, std::uint64_t rights) {
  const Descriptor at(::open(path.c_str(), O_PATH | O_CLOEXEC));
  if (at.get() < 0) return true;
  struct stat found {};
  if (::fstat(at.get(), &found) != 0) return false;
  if (!S_ISDIR(found.st_mode)) rights &= kOfFiles;
  const landlock_path_beneath_attr rule{rights, at.get()};
  return syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0;
}

}  // namespace

void add_system_files(FileRights& rights) {
  for (const char* path : {"/usr", "/lib", "/lib64", "/etc/ld.so.cache", "/etc/localtime", "/sys/devices/system",
                           "/proc/self", "/dev/null"})
    rights.read.emplace_back(path);
}

tl::expected<int, std::string> restrict_files(const FileRights& wanted) {
  const int version =
      static_cast<int>(syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION));
  if (version < 1) return cannot("be asked for its version");
  const std::uint64_t all = all_of(version);
  const RulesetAttributes attributes{all, version >= 4 ? kBindTcp | kConnectTcp : 0,
                                     version >= 6 ? kScopeAbstractUnix | kScopeSignal : 0};
  const std::size_t size = version >= 6 ? 24 : version >= 4 ? 16 : 8;
  const Descriptor ruleset(static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, size, 0)));
  if (ruleset.get() < 0) return cannot("make a set of rules");
  const auto allow_all = [&](const std::vector<std::string>& paths, std::uint64_t rights) {
    for (const std::string& path : paths)
      if (!allow(ruleset.get(), path, rights & all)) return &path;
    return static_cast<const std::string*>(nullptr);
  };
  const std::string* refused = allow_all(wanted.read, kRead);
  if (refused == nullptr) refused = allow_all(wanted.write, kWrite);
  if (refused == nullptr) refused = allow_all(wanted.use, kUse);
  if (refused != nullptr) return cannot(fmt::format("make a rule for {}", *refused));
  if (syscall(SYS_landlock_restrict_self, ruleset.get(), 0) != 0) return cannot("be put in force");
  return version;
}

}  // namespace farfeel::transport
