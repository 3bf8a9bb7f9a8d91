// What obedient_plug_in.so does: what is set here, in memory that test and plug-in share. C and C++.
//
// The test finds it with dlsym("obedience"): the plug-in tells exactly these values, and notes what it was told.
#pragma once

#include "master_station/devices/plug_in/farfeel_device.h"

struct farfeel_obedience {
  farfeel_device_plug_in table;  // what farfeel_device_v1() returns, unless has_no_table
  int has_no_table;
  int find_result, open_result, describe_result, zero_force_result, stage;
  unsigned devices;  // find() says END from this index on
  int gives_no_device;
  int has_endless_error;  // open() fills all of `error`, without a zero at its end
  farfeel_device_found found;
  farfeel_device_description description;
  farfeel_device_sample sample;  // struct_size apart
  farfeel_device_zero_force zero_force;
  char advice[600];
  // What it was told.
  farfeel_device_command command;
  farfeel_device_found opened;
  int steps, opens, closes;
};

#ifdef __cplusplus
extern "C" {
#endif
FARFEEL_DEVICE_EXPORT struct farfeel_obedience* obedience(void);
#ifdef __cplusplus
}
#endif
