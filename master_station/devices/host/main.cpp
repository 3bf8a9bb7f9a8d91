// farfeel-device: owns the hardware at the operator's hand.
#include "master_station/devices/driver/driver.h"
#include "master_station/devices/host/program.h"

int main(int argc, char** argv) {
  using namespace farfeel::devices;
  return run_program(argc, argv, driver_families(), [](std::string_view) -> const DeviceModel* { return nullptr; });
}
