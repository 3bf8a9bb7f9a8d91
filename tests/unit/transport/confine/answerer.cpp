// The other side of apart_test: what a decoder may do right or wrong, by name.

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "transport/confine/apart.h"

using Answered = tl::expected<std::vector<std::byte>, std::string>;

namespace {

Answered behave(std::string_view how, std::span<const std::byte> question) {
  if (how == "reverse") return std::vector<std::byte>(question.rbegin(), question.rend());
  if (how == "refuse") return tl::unexpected(std::string("no\x1b[31m such mesh"));
  if (how == "say much") return std::vector<std::byte>(question.size() * 100);
  if (how == "hoard") {
    std::vector<std::vector<std::byte>> all;
    for (;;) all.emplace_back(std::size_t{1} << 20, std::byte{1});
  }
  if (how == "crash") std::abort();
  if (how == "end") _exit(3);
  if (how == "open") (void)::open("/etc/passwd", O_RDONLY);
  if (how == "socket") (void)::socket(AF_INET, SOCK_DGRAM, 0);
  if (how == "run") ::execl("/bin/true", "true", nullptr);
  if (how == "close and stay") {
    ::close(0);
    ::close(1);
  }
  for (volatile bool is_on = true; is_on;) {
  }
  return std::vector<std::byte>();
}

}  // namespace

int main(int argc, char** argv) {
  const std::span arguments(argv, static_cast<std::size_t>(argc));
  if (argc > 1 && std::string_view(argv[1]) == "be deaf") return 0;
  return farfeel::transport::answer_apart(
      arguments, [&](std::span<const std::byte> question) { return behave(argv[1], question); });
}
