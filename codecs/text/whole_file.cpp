#include "codecs/text/whole_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

namespace farfeel::codecs {
namespace {

bool write_all(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Holds back what ends a program: amid a write it would leave the file beside.
class HeldStops {
 public:
  HeldStops() {
    sigset_t stops;
    sigemptyset(&stops);
    for (const int stop : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&stops, stop);
    ::pthread_sigmask(SIG_BLOCK, &stops, &before_);
  }
  ~HeldStops() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  HeldStops(const HeldStops&) = delete;
  HeldStops& operator=(const HeldStops&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace

std::string why_not_written(const std::string& path, int error) {
  const bool is_full = error == ENOSPC || error == EDQUOT;
  return fmt::format("could not write {}: {}{}", path, std::strerror(error),
                     is_full ? ": free some there, or choose a folder on another disk" : "");
}

std::string write_whole_file(const std::string& path, std::string_view bytes) {
  const HeldStops held;
  const std::string beside = fmt::format("{}.{}.part", path, ::getpid());
  const int file = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) return why_not_written(path, errno);
  int error = write_all(file, bytes) ? 0 : errno;
  if (::close(file) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(beside.c_str(), path.c_str()) != 0) error = errno;
  if (error == 0) return {};
  ::unlink(beside.c_str());
  return why_not_written(path, error);
}

}  // namespace farfeel::codecs
