#include "codecs/settings/trusted_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace farfeel::codecs {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 20;

struct Opened {
  explicit Opened(int number) : fd(number) {}
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  ~Opened() {
    if (fd >= 0) ::close(fd);
  }
  int fd;
};

tl::unexpected<std::string> not_read(const std::string& path, int error) {
  return tl::unexpected(fmt::format("could not read {}: {}", path, std::strerror(error)));
}

bool is_passed_over(const struct stat& s, const FileReader& reader) {
  return reader.user == 0 && reader.is_under_sudo && s.st_uid != 0;
}

/// What is wrong with who may write it; empty: nothing.
std::string complaint_about(const struct stat& s, const std::string& path, const FileReader& reader) {
  if (s.st_uid != 0 && s.st_uid != reader.user)
    return fmt::format(
        "{} belongs to user {}, and settings may name code to run: they have to be yours (user {}) or root's", path,
        s.st_uid, reader.user);
  const bool is_kept_apart = S_ISDIR(s.st_mode) && (s.st_mode & S_ISVTX) != 0;  // as /tmp: none removes another's files
  if ((s.st_mode & 022) != 0 && !is_kept_apart)
    return fmt::format(
        "others may write {} (mode {:04o}), and settings may name code to run. If it is as you left it, run:  chmod "
        "go-w '{}'",
        path, s.st_mode & 07777, path);
  return {};
}

}  // namespace

FileReader this_reader() {
  const char* const caller = std::getenv("SUDO_UID");
  return {::geteuid(), caller != nullptr && *caller != '\0' && std::strcmp(caller, "0") != 0};
}

tl::expected<std::optional<std::string>, std::string> read_trusted_file(const std::string& path,
                                                                        const FileReader& reader) {
  // O_NONBLOCK: a named pipe put there must not make the reader wait.
  const Opened file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.fd < 0 && (errno == ENOENT || errno == ENOTDIR)) return std::nullopt;
  struct stat its {
  }, above{};
  if (file.fd < 0 || ::fstat(file.fd, &its) != 0) return not_read(path, errno);
  // Where it really lies: who may write there may put another file in its place.
  std::error_code error;
  const std::string folder = std::filesystem::canonical(path, error).parent_path();
  if (error || ::stat(folder.c_str(), &above) != 0) return not_read(path, error ? error.value() : errno);
  if (is_passed_over(its, reader) || is_passed_over(above, reader)) return std::nullopt;
  if (!S_ISREG(its.st_mode)) return tl::unexpected(fmt::format("{} is no plain file", path));
  for (const auto& [what, where] : {std::pair{&its, path}, {&above, folder}})
    if (std::string wrong = complaint_about(*what, where, reader); !wrong.empty())
      return tl::unexpected(std::move(wrong));

  std::string text;
  std::array<char, 4096> piece{};
  for (ssize_t got = 0; (got = ::read(file.fd, piece.data(), piece.size())) != 0;) {
    if (got < 0) return not_read(path, errno);
    text.append(piece.data(), static_cast<std::size_t>(got));
    if (text.size() > kMostBytes)
      return tl::unexpected(fmt::format("{} is longer than 1 MiB: these are no settings", path));
  }
  return text;
}

}  // namespace farfeel::codecs
