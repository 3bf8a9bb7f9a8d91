// farfeel-device with a socket device for all its hardware: the same owner and keeper, as processes that a test may
// kill. serve --link-fd N --station PID --firmware SOCKET
#include <signal.h>
#include <sys/prctl.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <span>
#include <string_view>

#include "master_station/devices/host/keeper.h"
#include "master_station/devices/host/owner.h"
#include "tests/support/devices/socket_device.h"

namespace {

std::atomic<bool> stop_asked{false};

}  // namespace

int main(int argc, char** argv) {
  using namespace farfeel::devices;
  const std::span<char* const> arguments(argv, static_cast<std::size_t>(argc));
  if (const auto kept = keep_if_asked(arguments)) return *kept;
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  std::signal(SIGTERM, [](int) { stop_asked = true; });
  int link_fd = -1;
  DriverOptions options;
  for (std::size_t i = 1; i + 1 < arguments.size(); ++i) {
    if (std::string_view(arguments[i]) == "--link-fd") link_fd = std::atoi(arguments[i + 1]);
    if (std::string_view(arguments[i]) == "--firmware") options.firmware = arguments[i + 1];
  }
  auto link = MappedLink::open(link_fd);
  if (!link) return 1;
  Owner owner(link->memory(), link->fd(), std::span(&farfeel::test_support::kSocketDeviceFamily, 1), {}, options);
  owner.run(stop_asked);
  return 0;
}
