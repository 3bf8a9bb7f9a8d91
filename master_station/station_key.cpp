#include "master_station/station_key.h"

#include <poll.h>
#include <termios.h>
#include <unistd.h>

namespace farfeel::master_station {

struct StationKey::Terminal {
  termios settings;
};

StationKey::StationKey(std::unique_ptr<Terminal> before) : before_(std::move(before)) {}

std::unique_ptr<StationKey> StationKey::open() {
  auto before = std::make_unique<Terminal>();
  if (::isatty(STDIN_FILENO) == 0 || ::tcgetattr(STDIN_FILENO, &before->settings) != 0) return nullptr;
  termios raw = before->settings;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // Ctrl-C stays a signal
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  if (::tcsetattr(STDIN_FILENO, TCSANOW, &raw) != 0) return nullptr;
  return std::unique_ptr<StationKey>(new StationKey(std::move(before)));
}

StationKey::~StationKey() {
  ::tcsetattr(STDIN_FILENO, TCSANOW, &before_->settings);
}

std::int64_t StationKey::held_until_ns(std::int64_t now_ns) {
  char letter = 0;
  pollfd waiting{STDIN_FILENO, POLLIN, 0};
  while (::poll(&waiting, 1, 0) == 1 && ::read(STDIN_FILENO, &letter, 1) == 1) {
    if (letter == ' ') key_.came(now_ns);
  }
  return key_.until_ns();
}

}  // namespace farfeel::master_station
