// farfeel-device: owns the hardware at the operator's hand.
#include "master_station/devices/driver/driver.h"
#include "master_station/devices/host/program.h"
#include "master_station/devices/model/device_model.h"

int main(int argc, char** argv) {
  return farfeel::devices::run_program(argc, argv, farfeel::devices::driver_families(), &farfeel::devices::find_model);
}
