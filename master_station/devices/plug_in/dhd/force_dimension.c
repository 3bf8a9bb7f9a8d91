/* Force Dimension's devices (omega, delta, sigma) through their own library, which the user installs: libdhd.h.
 *
 * Frames. Their base frame has x towards the person, y to the right, z up. With v_B = M v_F,
 *     M = [ 0 1 0; -1 0 0; 0 0 1 ]:    x_B = y_F,  y_B = -x_F,  z_B = z_F,    R_BD = M R_FD M^T,
 * so that a handle in their reference orientation is in ours. A left-handed grip is taken to be told in the same
 * frames, mirrored by the library where that needs be: nobody has looked at one.
 *
 * Force. Motors and brakes stay as they are until force is first commanded; then force is enabled and the brakes are
 * opened. On a failure and at the end: zero force, brakes on, force disabled, which lets the arm sink slowly.
 *
 * Written from the public interface, and tried against an imitation of the library. It never met a device. */
#define _POSIX_C_SOURCE 200112L

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "farfeel_device.h"
#include "libdhd.h"

#define MAX_OPEN 16
/* A device that fails so long is gone: some 200 reports of 1 kHz. */
#define GONE_NS 200000000
/* How often the status is asked for: each costs a transfer. */
#define STEPS_A_STATUS 64
/* The watchdog counts in 125 us: 20 ms, as all of Farfeel takes force off a command that is so old. */
#define WATCHDOG_COUNTS 160
#define WATCHDOG_S 0.02

/* Force, torque, workspace and resolution are the maker's published figures. */
struct kind {
  int type;
  const char *model, *title;
  int rotation_dof, torque_dof, has_gripper;
  double radius_m, height_m, max_force_N, max_torque_Nm, position_step_m, rotation_step_rad;
};

static const struct kind kinds[] = {
    {33, "omega-3", "Force Dimension omega.3", 0, 0, 0, 0.08, 0.11, 12, 0, 1e-5, 0},
    {34, "omega-6", "Force Dimension omega.6", 3, 0, 0, 0.08, 0.11, 12, 0, 1e-5, 1.6e-3},
    {36, "omega-6", "Force Dimension omega.6 (left-handed)", 3, 0, 0, 0.08, 0.11, 12, 0, 1e-5, 1.6e-3},
    {35, "omega-7", "Force Dimension omega.7", 3, 0, 1, 0.08, 0.11, 12, 0, 1e-5, 1.6e-3},
    {37, "omega-7", "Force Dimension omega.7 (left-handed)", 3, 0, 1, 0.08, 0.11, 12, 0, 1e-5, 1.6e-3},
    {63, "delta-3", "Force Dimension delta.3", 0, 0, 0, 0.2, 0.26, 20, 0, 2e-5, 0},
    {64, "delta-6", "Force Dimension delta.6", 3, 3, 0, 0.2, 0.26, 20, 0.15, 2e-5, 7e-4},
    {104, "sigma-7", "Force Dimension sigma.7", 3, 3, 1, 0.095, 0.13, 20, 0.4, 1.5e-6, 2.3e-4},
    {105, "sigma-7", "Force Dimension sigma.7 (left-handed)", 3, 3, 1, 0.095, 0.13, 20, 0.4, 1.5e-6, 2.3e-4}};

struct farfeel_device {
  const struct libdhd* dhd;
  const struct kind* kind;
  char id; /* as the library counts */
  unsigned short serial;
  uint32_t index;
  int has_watchdog, is_powered, stage;
  int owes_power_off; /* a failure kept it from being powered off: again once it answers */
  unsigned steps;
  int64_t time_ns, seen_ns, failing_since_ns;
  uint64_t reports;
  farfeel_device_sample last;
  char advice[256];
};

static farfeel_device* opened[MAX_OPEN]; /* by the index of find() */

static int64_t now_ns(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

static const char* reason(const struct libdhd* dhd) {
  const char* const text = dhd->ErrorGetLastStr();
  return text != NULL ? text : "no reason told";
}

static const struct kind* kind_of(int type) {
  size_t i;
  for (i = 0; i < sizeof kinds / sizeof kinds[0]; ++i)
    if (kinds[i].type == type) return &kinds[i];
  return NULL;
}

static void fill_found(farfeel_device_found* found, const struct kind* kind, unsigned short serial, uint32_t index) {
  strcpy(found->model, kind != NULL ? kind->model : "force-dimension");
  snprintf(found->id, sizeof found->id, "%u", (unsigned)index);
  if (serial != 0) snprintf(found->serial, sizeof found->serial, "%u", (unsigned)serial);
}

static int32_t find_device(uint32_t index, farfeel_device_found* found) {
  char why[200];
  const struct libdhd* const dhd = libdhd_loaded(why, sizeof why);
  unsigned short serial = 0;
  int id;
  if (dhd == NULL) {
    if (index > 0) return FARFEEL_DEVICE_END;
    fill_found(found, NULL, 0, 0);
    snprintf(found->trouble, sizeof found->trouble, "%s", why);
    return FARFEEL_DEVICE_OK;
  }
  if (index >= MAX_OPEN || (int)index >= dhd->GetDeviceCount()) return FARFEEL_DEVICE_END;
  if (opened[index] != NULL) {
    fill_found(found, opened[index]->kind, opened[index]->serial, index);
    return FARFEEL_DEVICE_OK;
  }
  /* Serial number and kind are told of an open device only. Opening moves nothing. */
  id = dhd->OpenID((char)index);
  if (id < 0) {
    fill_found(found, NULL, 0, index);
    snprintf(found->trouble, sizeof found->trouble,
             "Force Dimension's device %u does not open (%.100s): is another program using it, and may this user write "
             "to its USB node?",
             (unsigned)index, reason(dhd));
    return FARFEEL_DEVICE_OK;
  }
  if (dhd->GetSerialNumber(&serial, (char)id) < 0) serial = 0;
  fill_found(found, kind_of(dhd->GetSystemType((char)id)), serial, index);
  dhd->Close((char)id);
  return FARFEEL_DEVICE_OK;
}

static void power_off(farfeel_device* device) {
  const struct libdhd* const dhd = device->dhd;
  const int force = dhd->SetForceAndTorqueAndGripperForce(0, 0, 0, 0, 0, 0, 0, device->id);
  const int brakes = dhd->SetBrakes(1, device->id);
  const int motors = dhd->EnableForce(0, device->id);
  device->is_powered = 0;
  device->owes_power_off = force < 0 || brakes < 0 || motors < 0;
}

static int32_t open_device(const farfeel_device_found* found, farfeel_device** device, char* error, size_t error_size) {
  const struct libdhd* const dhd = libdhd_loaded(error, error_size);
  const long index = strtol(found->id, NULL, 10);
  farfeel_device* made;
  int id;
  if (dhd == NULL) return FARFEEL_DEVICE_FAILED;
  if (index < 0 || index >= MAX_OPEN || opened[index] != NULL) {
    snprintf(error, error_size, "there is no device %ld that is not open already", index);
    return FARFEEL_DEVICE_FAILED;
  }
  id = dhd->OpenID((char)index);
  if (id < 0) {
    snprintf(error, error_size, "libdhd does not open device %ld: %s", index, reason(dhd));
    return FARFEEL_DEVICE_FAILED;
  }
  made = (farfeel_device*)calloc(1, sizeof *made);
  if (made == NULL || kind_of(dhd->GetSystemType((char)id)) == NULL) {
    snprintf(error, error_size, made == NULL ? "there is no memory left" : "libdhd's device type %d is not known here",
             dhd->GetSystemType((char)id));
    dhd->Close((char)id);
    free(made);
    return FARFEEL_DEVICE_FAILED;
  }
  made->dhd = dhd;
  made->id = (char)id;
  made->index = (uint32_t)index;
  made->kind = kind_of(dhd->GetSystemType((char)id));
  made->stage = FARFEEL_DEVICE_OPENING;
  made->last.orientation[0] = 1;
  if (dhd->GetSerialNumber(&made->serial, made->id) < 0) made->serial = 0;
  dhd->SetForceAndTorqueAndGripperForce(0, 0, 0, 0, 0, 0, 0, made->id);
  if (made->kind->has_gripper && dhd->EmulateButton != NULL) dhd->EmulateButton(1, made->id);
  if (dhd->EnableExpertMode != NULL && dhd->DisableExpertMode != NULL && dhd->EnableExpertMode() >= 0) {
    if (dhd->SetTimeGuard != NULL) dhd->SetTimeGuard(0, made->id); /* every step is to read anew */
    made->has_watchdog = dhd->SetWatchdog != NULL && dhd->SetWatchdog(WATCHDOG_COUNTS, made->id) >= 0;
    dhd->DisableExpertMode();
  }
  opened[index] = made;
  *device = made;
  return FARFEEL_DEVICE_OK;
}

static int32_t describe_device(farfeel_device* device, farfeel_device_description* is) {
  const struct kind* const kind = device->kind;
  strcpy(is->title, kind->title);
  strcpy(is->estimated,
         "rotation_step_rad, rate_Hz, sensor_delay_s, actuator_delay_s, mass_kg, inertia_kg_m2, "
         "viscous_friction_Ns_per_m, "
         "coulomb_friction_N, viscous_friction_Nms_per_rad, coulomb_friction_Nm, continuous_force_N, "
         "continuous_torque_Nm, thermal_time_s");
  if (!device->has_watchdog) strcat(is->estimated, ", holds_force_s");
  is->tells = FARFEEL_DEVICE_TELLS_POSE;
  is->position_dof = is->force_dof = 3;
  is->rotation_dof = kind->rotation_dof;
  is->torque_dof = kind->torque_dof;
  is->is_in_newtons = 1;
  is->enable_button = strncmp(kind->model, "delta", 5) == 0 ? -1 : 0;
  is->clutch_button = -1;
  is->workspace_max_B_m[0] = is->workspace_max_B_m[1] = kind->radius_m;
  is->workspace_min_B_m[0] = is->workspace_min_B_m[1] = -kind->radius_m;
  is->workspace_max_B_m[2] = kind->height_m / 2;
  is->workspace_min_B_m[2] = -kind->height_m / 2;
  is->position_step_m = kind->position_step_m;
  is->rotation_step_rad = kind->rotation_step_rad;
  is->rate_Hz = 1000;
  is->sensor_delay_s = is->actuator_delay_s = 1e-3; /* a USB transfer each */
  is->holds_force_s = device->has_watchdog ? WATCHDOG_S : (double)INFINITY;
  is->mass_kg = 0.25;
  is->inertia_kg_m2 = kind->rotation_dof > 0 ? 1e-4 : 0;
  is->viscous_friction_Ns_per_m = 0.5;
  is->max_force_N = kind->max_force_N;
  is->continuous_force_N = kind->max_force_N / 2;
  is->max_torque_Nm = kind->max_torque_Nm;
  is->continuous_torque_Nm = kind->max_torque_Nm / 2;
  return FARFEEL_DEVICE_OK;
}

static int fail(farfeel_device* device, const char* what) {
  const int64_t time_ns = now_ns();
  snprintf(device->advice, sizeof device->advice,
           "%s fails (%.100s): force is off; look at the device's power and cable", what, reason(device->dhd));
  power_off(device);
  if (device->failing_since_ns == 0) device->failing_since_ns = time_ns;
  return time_ns - device->failing_since_ns > GONE_NS ? FARFEEL_DEVICE_ABSENT : FARFEEL_DEVICE_FAULT;
}

/* READY, or what hinders. */
static int look_at_status(farfeel_device* device) {
  int status[kDhdStatuses] = {0};
  if (device->dhd->GetStatus(status, device->id) < 0) return fail(device, "asking for the status");
  if (!status[kDhdStatusPower] || status[kDhdStatusError]) {
    snprintf(device->advice, sizeof device->advice, "%s",
             status[kDhdStatusPower] ? "the device's controller tells an error: switch it off and on"
                                     : "the device has no power: switch it on");
    power_off(device);
    return FARFEEL_DEVICE_FAULT;
  }
  if (status[kDhdStatusReset] || (device->kind->rotation_dof > 0 && !status[kDhdStatusWristInit])) {
    snprintf(device->advice, sizeof device->advice,
             "hold the handle in its calibration pose and press the device's reset button, or run the SDK's "
             "initialization");
    if (device->is_powered) power_off(device);
    return FARFEEL_DEVICE_HOMING;
  }
  if (device->is_powered && !status[kDhdStatusForce]) {
    snprintf(device->advice, sizeof device->advice,
             "the device took its force off by itself (cause %d: 1 its button, 2 speed, 3 watchdog, 6 nobody held it)",
             status[kDhdStatusForceOffCause]);
    power_off(device);
    return FARFEEL_DEVICE_FAULT;
  }
  return FARFEEL_DEVICE_READY;
}

/* q of R_BD = M R M^T by Shepperd: the largest of four first, so that no root is of something small. Not normalised:
 * what is no rotation is to show. */
static void orientation(double R[3][3], double q[4]) {
  const double r[3][3] = {{R[1][1], -R[1][0], R[1][2]}, {-R[0][1], R[0][0], -R[0][2]}, {R[2][1], -R[2][0], R[2][2]}};
  const double trace = r[0][0] + r[1][1] + r[2][2];
  int i = 0;
  if (trace > 0) {
    const double root = sqrt(1 + trace);
    q[0] = root / 2;
    q[1] = (r[2][1] - r[1][2]) / (2 * root);
    q[2] = (r[0][2] - r[2][0]) / (2 * root);
    q[3] = (r[1][0] - r[0][1]) / (2 * root);
    return;
  }
  if (r[1][1] > r[0][0]) i = 1;
  if (r[2][2] > r[i][i]) i = 2;
  {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double root = sqrt(1 + r[i][i] - r[j][j] - r[k][k]);
    q[0] = (r[k][j] - r[j][k]) / (2 * root);
    q[1 + i] = root / 2;
    q[1 + j] = (r[j][i] + r[i][j]) / (2 * root);
    q[1 + k] = (r[k][i] + r[i][k]) / (2 * root);
  }
}

/* v_B = M v_F. */
static void to_base(const double v_F[3], double v_B[3]) {
  v_B[0] = v_F[1];
  v_B[1] = -v_F[0];
  v_B[2] = v_F[2];
}

static int read_device(farfeel_device* device) {
  const struct libdhd* const dhd = device->dhd;
  farfeel_device_sample* const last = &device->last;
  double p[3] = {0, 0, 0}, v[3] = {0, 0, 0}, w[3] = {0, 0, 0};
  double frame[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const int result = dhd->GetPositionAndOrientationFrame(&p[0], &p[1], &p[2], frame, device->id);
  int button;
  if (result < 0) return fail(device, "reading the position");
  device->seen_ns = now_ns();
  if (result == kDhdTimeGuard) return FARFEEL_DEVICE_READY; /* nothing new */
  device->time_ns = device->seen_ns;
  ++device->reports;
  to_base(p, last->position_m);
  if (device->kind->rotation_dof > 0) orientation(frame, last->orientation);
  /* The library has no velocity until it saw enough positions: then Farfeel estimates it. */
  last->has_velocity =
      dhd->GetLinearVelocity(&v[0], &v[1], &v[2], device->id) >= 0 &&
      (device->kind->rotation_dof == 0 || dhd->GetAngularVelocityRad(&w[0], &w[1], &w[2], device->id) >= 0);
  to_base(v, last->velocity_m_s);
  to_base(w, last->angular_velocity_rad_s);
  button = dhd->GetButton(0, device->id);
  if (button < 0) return fail(device, "reading the button");
  last->buttons = button > 0 ? 1 : 0;
  return FARFEEL_DEVICE_READY;
}

static int write_device(farfeel_device* device, const farfeel_device_command* command) {
  const struct libdhd* const dhd = device->dhd;
  const double *const f = command->force_B_N, *const t = command->torque_B_Nm;
  if (!command->is_force_on) {
    /* While the motors are off this is not needed, but it tells whether the device is there. */
    if (dhd->SetForceAndTorqueAndGripperForce(0, 0, 0, 0, 0, 0, 0, device->id) < 0)
      return fail(device, "setting zero force");
    return FARFEEL_DEVICE_READY;
  }
  if (!device->is_powered) {
    if (dhd->EnableForce(1, device->id) < 0) return fail(device, "enabling force");
    if (dhd->SetBrakes(0, device->id) < 0) return fail(device, "opening the brakes");
    device->is_powered = 1;
  }
  /* v_F = M^T v_B. */
  if (dhd->SetForceAndTorqueAndGripperForce(-f[1], f[0], f[2], -t[1], t[0], t[2], 0, device->id) < 0)
    return fail(device, "setting the force");
  return FARFEEL_DEVICE_READY;
}

static int32_t step_device(farfeel_device* device, int64_t deadline_ns, const farfeel_device_command* command,
                           farfeel_device_sample* sample) {
  const uint32_t struct_size = sample->struct_size;
  int stage = FARFEEL_DEVICE_READY;
  (void)deadline_ns; /* the library's calls wait for their own transfers */
  if (device->owes_power_off) power_off(device);
  if (device->stage != FARFEEL_DEVICE_READY || device->steps++ % STEPS_A_STATUS == 0) stage = look_at_status(device);
  if (stage == FARFEEL_DEVICE_READY) stage = read_device(device);
  if (stage == FARFEEL_DEVICE_READY) stage = write_device(device, command);
  if (stage == FARFEEL_DEVICE_READY) {
    device->failing_since_ns = 0;
    device->advice[0] = '\0';
  }
  device->stage = stage;
  *sample = device->last;
  sample->struct_size = struct_size;
  sample->time_ns = device->time_ns;
  sample->seen_ns = device->seen_ns;
  sample->reports = device->reports;
  return stage;
}

static void advise(farfeel_device* device, char* text, size_t text_size) {
  snprintf(text, text_size, "%s", device->advice);
}

static void close_device(farfeel_device* device) {
  power_off(device);
  device->dhd->Close(device->id);
  opened[device->index] = NULL;
  free(device);
}

const farfeel_device_plug_in* farfeel_device_v1(void) {
  static const farfeel_device_plug_in plug_in = {sizeof(farfeel_device_plug_in),
                                                 FARFEEL_DEVICE_ABI,
                                                 "Force Dimension (libdhd)",
                                                 find_device,
                                                 open_device,
                                                 describe_device,
                                                 step_device,
                                                 advise,
                                                 close_device,
                                                 NULL};
  return &plug_in;
}
