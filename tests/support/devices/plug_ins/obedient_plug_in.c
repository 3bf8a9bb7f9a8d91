/* A plug-in that does what a test says: see obedient_plug_in.h. */
#include "obedient_plug_in.h"

#include <string.h>

struct farfeel_device {
  int unused;
};

static struct farfeel_obedience is;
static struct farfeel_device the_device;

FARFEEL_DEVICE_EXPORT struct farfeel_obedience* obedience(void) {
  return &is;
}

/* All but the caller's struct_size. */
#define TELL(to, from, type) \
  memcpy((char*)(to) + sizeof(uint32_t), (const char*)(from) + sizeof(uint32_t), sizeof(type) - sizeof(uint32_t))

static int32_t find_device(uint32_t index, farfeel_device_found* found) {
  if (index >= is.devices) return FARFEEL_DEVICE_END;
  TELL(found, &is.found, farfeel_device_found);
  return is.find_result;
}

static int32_t open_device(const farfeel_device_found* found, farfeel_device** device, char* error, size_t error_size) {
  ++is.opens;
  is.opened = *found;
  if (is.has_endless_error) memset(error, 'x', error_size);
  if (!is.gives_no_device) *device = &the_device;
  return is.open_result;
}

static int32_t describe_device(farfeel_device* device, farfeel_device_description* description) {
  (void)device;
  TELL(description, &is.description, farfeel_device_description);
  return is.describe_result;
}

static int32_t step_device(farfeel_device* device, int64_t deadline_ns, const farfeel_device_command* command,
                           farfeel_device_sample* sample) {
  (void)device;
  (void)deadline_ns;
  ++is.steps;
  is.command = *command;
  TELL(sample, &is.sample, farfeel_device_sample);
  return is.stage;
}

static void advise(farfeel_device* device, char* text, size_t text_size) {
  (void)device;
  memcpy(text, is.advice, text_size < sizeof is.advice ? text_size : sizeof is.advice);
}

static void close_device(farfeel_device* device) {
  (void)device;
  ++is.closes;
}

static int32_t take_force_off(farfeel_device* device, farfeel_device_zero_force* how) {
  (void)device;
  TELL(how, &is.zero_force, farfeel_device_zero_force);
  return is.zero_force_result;
}

static const farfeel_device_plug_in whole_table = {sizeof(farfeel_device_plug_in),
                                                   FARFEEL_DEVICE_ABI,
                                                   "obedient",
                                                   find_device,
                                                   open_device,
                                                   describe_device,
                                                   step_device,
                                                   advise,
                                                   close_device,
                                                   take_force_off};

const farfeel_device_plug_in* farfeel_device_v1(void) {
  if (is.has_no_table) return 0;
  if (is.table.struct_size == 0) is.table = whole_table;
  return &is.table;
}
