// farfeel-device with a socket device for all its hardware: every command of it, as processes that a test may kill.
// --firmware SOCKET says where the device is.
#include <span>

#include "master_station/devices/host/program.h"
#include "tests/support/devices/socket_device.h"

int main(int argc, char** argv) {
  using namespace farfeel;
  return devices::run_program(argc, argv, std::span(&test_support::kSocketDeviceFamily, 1),
                              &test_support::socket_device_model);
}
