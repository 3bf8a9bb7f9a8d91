#include "transport/relay/key_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace farfeel::transport {
namespace {

constexpr std::size_t kTextBytes = 65;  // 64 hexadecimal digits and a new line

tl::unexpected<Error> fail(ErrorKind kind, const std::string& what, const std::string& path,
                           const std::string& advice) {
  return tl::unexpected(Error{kind, what + " " + path + ": " + advice});
}

tl::expected<Key32, Error> read_key(int descriptor, const std::string& path) {
  struct stat status {};
  if (fstat(descriptor, &status) != 0)
    return fail(ErrorKind::kSocket, "cannot look at the relay's key", path, std::string(std::strerror(errno)) + ".");
  if (status.st_uid != geteuid() || (status.st_mode & 077) != 0)
    return fail(
        ErrorKind::kRefused, "refused the relay's key", path,
        "others may read or own it. Make it yours alone: chown and chmod 600; if others have read it, delete it "
        "and give out new tokens.");
  char text[kTextBytes + 1];
  const ssize_t size = ::read(descriptor, text, sizeof text);
  Key32 key{};
  bool is_key = size == static_cast<ssize_t>(kTextBytes) && text[kTextBytes - 1] == '\n';
  for (std::size_t i = 0; is_key && i + 1 < kTextBytes; ++i) {
    const char c = text[i];
    const int digit = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
    is_key = digit >= 0;
    if (is_key) key[i / 2] |= static_cast<std::byte>(digit << (i % 2 == 0 ? 4 : 0));
  }
  if (!is_key)
    return fail(ErrorKind::kAddress, "cannot use the relay's key", path,
                "it is not 64 hexadecimal digits. Delete it, and a new one is made; tokens of the old one end then.");
  return key;
}

}  // namespace

std::string default_relay_key_path() {
  const char* const config = std::getenv("XDG_CONFIG_HOME");
  const char* const home = std::getenv("HOME");
  const std::string base =
      config != nullptr && *config != '\0' ? config : (home != nullptr ? home : ".") + std::string("/.config");
  return base + "/farfeel/relay.key";
}

tl::expected<Key32, Error> read_or_make_relay_key(const std::string& path) {
  int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0 && errno == ENOENT) {
    std::error_code ignored;  // if there is no folder, the file cannot be made, and that is told
    if (const auto folder = std::filesystem::path(path).parent_path(); !folder.empty())
      std::filesystem::create_directories(folder, ignored);
    const int fresh = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fresh < 0)
      return fail(ErrorKind::kSocket, "cannot make the relay's key", path,
                  std::string(std::strerror(errno)) + ". Name another file with --key.");
    const Key32 key = random_key();
    std::string text;
    for (const std::byte b : key)
      for (const int shift : {4, 0}) text += "0123456789abcdef"[std::to_integer<int>(b) >> shift & 15];
    text += '\n';
    const bool is_written =
        ::write(fresh, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && ::fsync(fresh) == 0;
    ::close(fresh);
    if (is_written) return key;
    ::unlink(path.c_str());
    return fail(ErrorKind::kSocket, "cannot write the relay's key", path, std::string(std::strerror(errno)) + ".");
  }
  if (descriptor < 0)
    return fail(ErrorKind::kSocket, "cannot open the relay's key", path, std::string(std::strerror(errno)) + ".");
  auto key = read_key(descriptor, path);
  ::close(descriptor);
  return key;
}

}  // namespace farfeel::transport
