#include "transport/keys/checked_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <thread>

#include "transport/seal/suite.h"

namespace farfeel::transport {
namespace {

constexpr auto kLockWait = std::chrono::seconds(5);  // a change takes milliseconds
constexpr auto kLockPause = std::chrono::milliseconds(10);

tl::unexpected<KeysError> error(KeysErrorKind kind, std::string message) {
  return tl::unexpected(KeysError{kind, std::move(message)});
}
tl::unexpected<KeysError> system_error(std::string_view what, const std::string& path) {
  const int code = errno;
  return error(code == ENOENT ? KeysErrorKind::kMissing
                              : (code == EACCES ? KeysErrorKind::kPermissions : KeysErrorKind::kSystem),
               fmt::format("could not {} {}: {}", what, path, std::strerror(code)));
}

struct Descriptor {
  explicit Descriptor(int number) : fd(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd >= 0) close(fd);
  }
  int fd;
};

KeysResult<void> check_owner_and_mode(const struct stat& s, const std::string& path, const char* mode_to_set) {
  if (s.st_uid != geteuid())
    return error(KeysErrorKind::kPermissions,
                 fmt::format("{} belongs to user {} and this program runs as user {}: run it as that user, or name "
                             "another folder",
                             path, s.st_uid, geteuid()));
  if ((s.st_mode & 077) != 0)
    return error(KeysErrorKind::kPermissions,
                 fmt::format("others may use {} (mode {:04o}), and it holds secrets. If nobody has copied it, run:  "
                             "chmod {} '{}'",
                             path, s.st_mode & 07777, mode_to_set, path));
  return {};
}

KeysResult<void> write_all(int fd, std::string_view text, const std::string& path) {
  while (!text.empty()) {
    const ssize_t n = write(fd, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return system_error("write", path);
    text.remove_prefix(static_cast<std::size_t>(n));
  }
  return {};
}

}  // namespace

KeysResult<void> check_private_folder(const std::string& folder) {
  struct stat s {};
  if (stat(folder.c_str(), &s) != 0) return system_error("open the folder", folder);
  if (!S_ISDIR(s.st_mode)) return error(KeysErrorKind::kMalformed, fmt::format("{} is no folder", folder));
  return check_owner_and_mode(s, folder, "700");
}

KeysResult<void> make_private_folder(const std::string& folder) {
  std::error_code trouble;
  const auto above = std::filesystem::path(folder).parent_path();
  if (!above.empty()) std::filesystem::create_directories(above, trouble);
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) return system_error("make the folder", folder);
  return check_private_folder(folder);
}

KeysResult<std::string> make_runtime_folder(std::string_view name) {
  // Everybody may write to /tmp: each folder from there on is checked to be ours. XDG_RUNTIME_DIR is another user's
  // where somebody became root with it still set.
  const char* const told = std::getenv("XDG_RUNTIME_DIR");
  std::string path = told == nullptr ? "" : told;
  struct stat s {};
  if (path.empty() || stat(path.c_str(), &s) != 0 || !S_ISDIR(s.st_mode) || s.st_uid != geteuid()) {
    path = fmt::format("/tmp/farfeel-{}", geteuid());
    if (const auto ok = make_private_folder(path); !ok) return tl::unexpected(ok.error());
  }
  for (const std::string& below : {std::string("/farfeel"), "/" + std::string(name)}) {
    path += below;
    if (const auto ok = make_private_folder(path); !ok) return tl::unexpected(ok.error());
  }
  return path;
}

KeysResult<std::string> read_private_file(const std::string& path) {
  // O_NONBLOCK: a named pipe put there must not make the reader wait.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.fd < 0) return system_error("read", path);
  struct stat s {};
  if (fstat(file.fd, &s) != 0) return system_error("look at", path);
  if (!S_ISREG(s.st_mode)) return error(KeysErrorKind::kMalformed, fmt::format("{} is no plain file", path));
  if (const auto ok = check_owner_and_mode(s, path, "600"); !ok) return tl::unexpected(ok.error());
  std::string text;
  if (s.st_size > 0 && static_cast<std::size_t>(s.st_size) <= kKeyFileBytesMax)
    text.reserve(static_cast<std::size_t>(s.st_size));  // growing would leave copies of a secret behind
  char part[4096];
  while (true) {
    const ssize_t n = read(file.fd, part, sizeof part);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return system_error("read", path);
    if (n == 0) break;
    text.append(part, static_cast<std::size_t>(n));
    if (text.size() > kKeyFileBytesMax)
      return error(KeysErrorKind::kMalformed,
                   fmt::format("{} is longer than {} bytes: it is no file of keys", path, kKeyFileBytesMax));
  }
  wipe(std::as_writable_bytes(std::span(part)));
  return text;
}

KeysResult<void> write_private_file(const std::string& path, std::string_view text) {
  const std::string fresh = path + ".new";
  unlink(fresh.c_str());  // what a program that died left
  {
    const Descriptor file(open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
    if (file.fd < 0) return system_error("write", fresh);
    auto written = write_all(file.fd, text, fresh);
    if (written && fsync(file.fd) != 0) written = system_error("write", fresh);
    if (!written) {
      unlink(fresh.c_str());
      return written;
    }
  }
  if (rename(fresh.c_str(), path.c_str()) != 0) return system_error("put in place", path);
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const Descriptor above(open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (above.fd >= 0) (void)fsync(above.fd);  // best effort: some file systems refuse it
  return {};
}

KeysResult<FolderLock> FolderLock::take(const std::string& folder) {
  const std::string path = folder + "/.lock";
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) return system_error("open", path);
  FolderLock lock(fd);
  const auto until = std::chrono::steady_clock::now() + kLockWait;
  while (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK && errno != EINTR) return system_error("lock", path);
    if (std::chrono::steady_clock::now() > until)
      return error(KeysErrorKind::kSystem,
                   fmt::format("another program has kept {} locked for 5 s: see who with  fuser '{}'", folder, path));
    std::this_thread::sleep_for(kLockPause);
  }
  return lock;
}

FolderLock::~FolderLock() {
  if (fd_ >= 0) close(fd_);
}

}  // namespace farfeel::transport
