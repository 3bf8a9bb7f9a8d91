#include "imitation_libdhd.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define EXPORT __attribute__((visibility("default")))

static struct imitated_libdhd is;

EXPORT struct imitated_libdhd* imitation(void) {
  return &is;
}

static int fails(const char* call) {
  ++is.calls;
  if (is.failing == NULL || (strcmp(is.failing, call) != 0 && strcmp(is.failing, "*") != 0)) return 0;
  is.has_failed = 1;
  return 1;
}

/* The device, if the call does not fail. */
static struct imitated_device* device(const char* call, char id) {
  if (fails(call) || id < 10 || id >= 10 + is.count || !is.devices[id - 10].is_open) return NULL;
  return &is.devices[id - 10];
}

EXPORT int dhdGetDeviceCount(void);
int dhdGetDeviceCount(void) {
  return is.count;
}

EXPORT int dhdOpenID(char index);
int dhdOpenID(char index) {
  if (fails("dhdOpenID") || index < 0 || index >= is.count || is.devices[(int)index].is_open) return -1;
  is.devices[(int)index].is_open = 1;
  return 10 + index; /* not the index: these are two things */
}

EXPORT int dhdClose(char id);
int dhdClose(char id) {
  struct imitated_device* const d = device("dhdClose", id);
  if (d == NULL) return -1;
  d->is_open = 0;
  return 0;
}

EXPORT int dhdGetSerialNumber(unsigned short* serial, char id);
int dhdGetSerialNumber(unsigned short* serial, char id) {
  struct imitated_device* const d = device("dhdGetSerialNumber", id);
  if (d == NULL) return -1;
  *serial = d->serial;
  return 0;
}

EXPORT int dhdGetSystemType(char id);
int dhdGetSystemType(char id) {
  struct imitated_device* const d = device("dhdGetSystemType", id);
  return d == NULL ? -1 : d->type;
}

EXPORT int dhdGetStatus(int status[16], char id);
int dhdGetStatus(int status[16], char id) {
  struct imitated_device* const d = device("dhdGetStatus", id);
  if (d == NULL) return -1;
  memset(status, 0, 16 * sizeof status[0]);
  status[0] = d->is_powered_up, status[1] = 1, status[3] = d->needs_reset;
  status[5] = d->force_is_enabled && !d->forgets_force, status[6] = d->brakes_are_on, status[9] = d->has_error;
  status[12] = d->wrist_is_initialised, status[14] = d->forgets_force ? 2 : 0;
  return 0;
}

EXPORT int dhdEnableForce(unsigned char is_on, char id);
int dhdEnableForce(unsigned char is_on, char id) {
  struct imitated_device* const d = device("dhdEnableForce", id);
  if (d == NULL) return -1;
  d->force_is_enabled = is_on;
  return 0;
}

EXPORT int dhdSetBrakes(int is_on, char id);
int dhdSetBrakes(int is_on, char id) {
  struct imitated_device* const d = device("dhdSetBrakes", id);
  if (d == NULL) return -1;
  d->brakes_are_on = is_on;
  return 0;
}

EXPORT int dhdGetButton(int index, char id);
int dhdGetButton(int index, char id) {
  struct imitated_device* const d = device("dhdGetButton", id);
  if (d == NULL || index != 0) return -1;
  /* The grip of these closes, and is a button only where that is asked for. */
  return d->type == 104 || d->type == 35 || d->type == 37 ? d->button && d->button_is_emulated : d->button;
}

EXPORT int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double frame[3][3], char id);
int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double frame[3][3], char id) {
  struct imitated_device* const d = device("dhdGetPositionAndOrientationFrame", id);
  double p[3];
  int i;
  if (d == NULL) return -1;
  for (i = 0; i < 3; ++i) {
    const int pushes = d->force_is_enabled && !d->brakes_are_on && !d->forgets_force;
    p[i] = d->rest_F_m[i] + (pushes ? d->force_F_N[i] / kImitatedStiffness_N_per_m : 0);
  }
  *x = p[0], *y = p[1], *z = p[2];
  memcpy(frame, d->frame_F, sizeof d->frame_F);
  return is.result_of_reading;
}

EXPORT int dhdGetLinearVelocity(double* x, double* y, double* z, char id);
int dhdGetLinearVelocity(double* x, double* y, double* z, char id) {
  struct imitated_device* const d = device("dhdGetLinearVelocity", id);
  if (d == NULL) return -1;
  *x = d->velocity_F_m_s[0], *y = d->velocity_F_m_s[1], *z = d->velocity_F_m_s[2];
  return 0;
}

#ifndef WITHOUT_ANGULAR_VELOCITY
EXPORT int dhdGetAngularVelocityRad(double* x, double* y, double* z, char id);
int dhdGetAngularVelocityRad(double* x, double* y, double* z, char id) {
  struct imitated_device* const d = device("dhdGetAngularVelocityRad", id);
  if (d == NULL) return -1;
  *x = d->angular_velocity_F_rad_s[0], *y = d->angular_velocity_F_rad_s[1], *z = d->angular_velocity_F_rad_s[2];
  return 0;
}
#endif

EXPORT int dhdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz, double tx, double ty, double tz,
                                               double grip, char id);
int dhdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz, double tx, double ty, double tz, double grip,
                                        char id) {
  const double force_N = sqrt(fx * fx + fy * fy + fz * fz);
  struct imitated_device* d;
  if (is.has_failed && force_N > is.largest_force_after_failure_N) is.largest_force_after_failure_N = force_N;
  d = device("dhdSetForceAndTorqueAndGripperForce", id);
  if (d == NULL) return -1;
  d->force_F_N[0] = fx, d->force_F_N[1] = fy, d->force_F_N[2] = fz;
  d->torque_F_Nm[0] = tx, d->torque_F_Nm[1] = ty, d->torque_F_Nm[2] = tz;
  d->grip_N = grip;
  return force_N > 11 ? 2 : 0; /* a motor is at its limit: no error */
}

EXPORT const char* dhdErrorGetLastStr(void);
const char* dhdErrorGetLastStr(void) {
  return is.failing != NULL ? "communication error" : "no error";
}

EXPORT int dhdEmulateButton(unsigned char is_on, char id);
int dhdEmulateButton(unsigned char is_on, char id) {
  struct imitated_device* const d = device("dhdEmulateButton", id);
  if (d == NULL) return -1;
  d->button_is_emulated = is_on;
  return 0;
}

#ifndef WITHOUT_ANGULAR_VELOCITY /* an old library: it lacks these, too */
EXPORT int dhdEnableExpertMode(void);
int dhdEnableExpertMode(void) {
  return is.is_expert = 1, 0;
}

EXPORT int dhdDisableExpertMode(void);
int dhdDisableExpertMode(void) {
  return is.is_expert = 0;
}

EXPORT int dhdSetTimeGuard(int least_us, char id);
int dhdSetTimeGuard(int least_us, char id) {
  struct imitated_device* const d = device("dhdSetTimeGuard", id);
  if (d == NULL || !is.is_expert) return -1;
  d->time_guard_us = least_us;
  return 0;
}

EXPORT int dhdSetWatchdog(unsigned char times_125_us, char id);
int dhdSetWatchdog(unsigned char times_125_us, char id) {
  struct imitated_device* const d = device("dhdSetWatchdog", id);
  if (d == NULL || !is.is_expert) return -1;
  d->watchdog = times_125_us;
  return 0;
}
#endif
