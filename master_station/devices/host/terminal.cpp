#include "master_station/devices/host/terminal.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>

namespace farfeel::devices {
namespace {

std::atomic<bool> end_asked{false};

}  // namespace

Terminal::Terminal() : has_screen_(isatty(STDOUT_FILENO) != 0) {
  termios now{};
  if (isatty(STDIN_FILENO) == 0 || tcgetattr(STDIN_FILENO, &now) != 0) return;
  before_ = now;
  now.c_lflag &= ~static_cast<tcflag_t>(ICANON);  // bytes as they are typed; Ctrl-C stays a signal
  tcsetattr(STDIN_FILENO, TCSANOW, &now);
}

Terminal::~Terminal() {
  if (before_) tcsetattr(STDIN_FILENO, TCSANOW, &*before_);
}

std::optional<char> Terminal::key() {
  pollfd waiting{STDIN_FILENO, POLLIN, 0};
  if (has_ended_ || ::poll(&waiting, 1, 0) != 1) return std::nullopt;
  char byte = 0;
  if (::read(STDIN_FILENO, &byte, 1) == 1) return byte;
  has_ended_ = true;
  return std::nullopt;
}

void Terminal::say(std::string_view line) {
  drawn_lines_ = 0;
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

void Terminal::draw(std::string_view picture) {
  if (has_screen_ && drawn_lines_ > 0) fmt::print("\033[{}A\r\033[J", drawn_lines_);  // up, and clear from there
  fmt::print("{}", picture);
  std::fflush(stdout);
  drawn_lines_ = static_cast<std::size_t>(std::ranges::count(picture, '\n'));
}

const std::atomic<bool>& asked_to_end() {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) std::signal(number, [](int) { end_asked = true; });
  std::signal(SIGPIPE, SIG_IGN);
  return end_asked;
}

}  // namespace farfeel::devices
