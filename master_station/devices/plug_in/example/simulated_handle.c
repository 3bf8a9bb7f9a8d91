/* A plug-in to start from: a simulated handle with six degrees of freedom, on springs that hold it in the middle. Force
 * and torque move it, and it says where it went.
 *
 *     cc -std=c99 -O2 -shared -fPIC -I.. -o simulated_handle.so simulated_handle.c -lm
 *
 * A real plug-in has the same functions: find() looks for the hardware, step() reads a report and writes a command. */
#define _POSIX_C_SOURCE 200112L

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "farfeel_device.h"

/* The mechanics, per axis: m x'' = f - k x - c x', and likewise about each axis. Damped so that it swings once. */
#define MASS_KG 0.1
#define STIFFNESS_N_PER_M 200.0
#define DAMPING_NS_PER_M 6.0
#define INERTIA_KG_M2 1e-4
#define STIFFNESS_NM_PER_RAD 0.5
#define DAMPING_NMS_PER_RAD 0.01
#define MAX_FORCE_N 10.0
#define MAX_TORQUE_NM 0.5
/* The springs' frequencies are 45 and 71 rad/s: a step of 0.25 ms is 1/57 of the shorter one's radian. */
#define STEP_NS 250000
#define REPORT_NS 1000000
/* Without a command for so long the simulated motors go off, as a real device's should. */
#define HOLDS_FORCE_NS 20000000
#define LONGEST_NS 200000000

struct farfeel_device {
  double p_m[3], v_m_s[3]; /* of the handle, in B */
  double q[4], w_rad_s[3]; /* w, x, y, z */
  double force_N[3], torque_Nm[3];
  int64_t simulated_ns; /* the state is of this time */
  int64_t commanded_ns;
  uint64_t reports;
};

static int64_t now_ns(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

static void wait_until(int64_t at_ns) {
  struct timespec time;
  time.tv_sec = (time_t)(at_ns / 1000000000);
  time.tv_nsec = (long)(at_ns % 1000000000);
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, NULL);
}

/* The vector about which q turns, as long as the angle, in [0, pi]. */
static void rotation_vector(const double q[4], double v_rad[3]) {
  const double sine = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double sign = q[0] < 0 ? -1 : 1;
  const double scale = sine < 1e-12 ? 2 * sign : 2 * atan2(sine, fabs(q[0])) * sign / sine;
  int i;
  for (i = 0; i < 3; ++i) v_rad[i] = scale * q[1 + i];
}

/* q' = 1/2 (0, w) q, with w in B. */
static void turn(double q[4], const double w_rad_s[3], double step_s) {
  const double x = 0.5 * step_s * w_rad_s[0], y = 0.5 * step_s * w_rad_s[1], z = 0.5 * step_s * w_rad_s[2];
  const double to[4] = {q[0] - x * q[1] - y * q[2] - z * q[3], q[1] + x * q[0] + y * q[3] - z * q[2],
                        q[2] + y * q[0] + z * q[1] - x * q[3], q[3] + z * q[0] + x * q[2] - y * q[1]};
  const double length = sqrt(to[0] * to[0] + to[1] * to[1] + to[2] * to[2] + to[3] * to[3]);
  int i;
  for (i = 0; i < 4; ++i) q[i] = to[i] / length;
}

static void simulate(farfeel_device* device, int64_t until_ns) {
  const double step_s = 1e-9 * STEP_NS;
  if (until_ns - device->simulated_ns > LONGEST_NS) device->simulated_ns = until_ns - LONGEST_NS;
  while (device->simulated_ns + STEP_NS <= until_ns) {
    const int is_driven = device->simulated_ns - device->commanded_ns < HOLDS_FORCE_NS;
    double turned_rad[3];
    int i;
    rotation_vector(device->q, turned_rad);
    for (i = 0; i < 3; ++i) { /* velocity first: semi-implicit, which does not gain energy */
      const double force_N = is_driven ? device->force_N[i] : 0, torque_Nm = is_driven ? device->torque_Nm[i] : 0;
      device->v_m_s[i] +=
          step_s * (force_N - STIFFNESS_N_PER_M * device->p_m[i] - DAMPING_NS_PER_M * device->v_m_s[i]) / MASS_KG;
      device->p_m[i] += step_s * device->v_m_s[i];
      device->w_rad_s[i] +=
          step_s * (torque_Nm - STIFFNESS_NM_PER_RAD * turned_rad[i] - DAMPING_NMS_PER_RAD * device->w_rad_s[i]) /
          INERTIA_KG_M2;
    }
    turn(device->q, device->w_rad_s, step_s);
    device->simulated_ns += STEP_NS;
  }
}

static int32_t find_device(uint32_t index, farfeel_device_found* found) {
  if (index > 0) return FARFEEL_DEVICE_END;
  strcpy(found->model, "simulated-handle");
  strcpy(found->serial, "1");
  strcpy(found->id, "1");
  return FARFEEL_DEVICE_OK;
}

static int32_t open_device(const farfeel_device_found* found, farfeel_device** device, char* error, size_t error_size) {
  if (strcmp(found->id, "1") != 0) {
    snprintf(error, error_size, "there is no simulated handle %s: only 1", found->id);
    return FARFEEL_DEVICE_FAILED;
  }
  *device = (farfeel_device*)calloc(1, sizeof **device);
  if (*device == NULL) {
    snprintf(error, error_size, "there is no memory left");
    return FARFEEL_DEVICE_FAILED;
  }
  (*device)->q[0] = 1;
  (*device)->simulated_ns = now_ns();
  return FARFEEL_DEVICE_OK;
}

static int32_t describe_device(farfeel_device* device, farfeel_device_description* is) {
  int i;
  (void)device;
  strcpy(is->title, "Simulated handle on springs");
  is->tells = FARFEEL_DEVICE_TELLS_POSE;
  is->position_dof = is->rotation_dof = is->force_dof = is->torque_dof = 3;
  is->is_in_newtons = 1;
  is->enable_button = is->clutch_button = -1;
  for (i = 0; i < 3; ++i) {
    is->workspace_min_B_m[i] = -0.1;
    is->workspace_max_B_m[i] = 0.1;
  }
  is->position_step_m = is->rotation_step_rad = 1e-6;
  is->rate_Hz = 1e9 / REPORT_NS;
  is->sensor_delay_s = is->actuator_delay_s = 0;
  is->holds_force_s = 1e-9 * HOLDS_FORCE_NS;
  is->mass_kg = MASS_KG;
  is->inertia_kg_m2 = INERTIA_KG_M2;
  is->viscous_friction_Ns_per_m = DAMPING_NS_PER_M;
  is->viscous_friction_Nms_per_rad = DAMPING_NMS_PER_RAD;
  is->max_force_N = is->continuous_force_N = MAX_FORCE_N;
  is->max_torque_Nm = is->continuous_torque_Nm = MAX_TORQUE_NM;
  return FARFEEL_DEVICE_OK;
}

static int32_t step_device(farfeel_device* device, int64_t deadline_ns, const farfeel_device_command* command,
                           farfeel_device_sample* sample) {
  const int64_t report_ns = device->simulated_ns + REPORT_NS;
  int64_t time_ns = now_ns();
  int i;
  simulate(device, time_ns); /* under the command before */
  for (i = 0; i < 3; ++i) {
    device->force_N[i] = command->is_force_on ? command->force_B_N[i] : 0;
    device->torque_Nm[i] = command->is_force_on ? command->torque_B_Nm[i] : 0;
  }
  device->commanded_ns = time_ns;
  if (report_ns > time_ns) {
    wait_until(report_ns < deadline_ns ? report_ns : deadline_ns);
    time_ns = now_ns();
    simulate(device, time_ns);
  }
  ++device->reports;
  sample->time_ns = sample->seen_ns = device->simulated_ns;
  sample->reports = device->reports;
  sample->has_velocity = 1;
  for (i = 0; i < 3; ++i) {
    sample->position_m[i] = device->p_m[i];
    sample->velocity_m_s[i] = device->v_m_s[i];
    sample->angular_velocity_rad_s[i] = device->w_rad_s[i];
  }
  for (i = 0; i < 4; ++i) sample->orientation[i] = device->q[i];
  return FARFEEL_DEVICE_READY;
}

static void advise(farfeel_device* device, char* text, size_t text_size) {
  (void)device;
  if (text_size > 0) text[0] = '\0';
}

static void close_device(farfeel_device* device) {
  free(device);
}

const farfeel_device_plug_in* farfeel_device_v1(void) {
  static const farfeel_device_plug_in plug_in = {sizeof(farfeel_device_plug_in),
                                                 FARFEEL_DEVICE_ABI,
                                                 "simulated handle",
                                                 find_device,
                                                 open_device,
                                                 describe_device,
                                                 step_device,
                                                 advise,
                                                 close_device,
                                                 NULL};
  return &plug_in;
}
