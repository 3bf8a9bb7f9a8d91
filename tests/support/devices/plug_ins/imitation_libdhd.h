// An imitation of Force Dimension's libdhd, from the public interface: names, arguments, results, units, frames. Its
// devices are handles on springs, so that forces reach the reading. The test sets and reads all of it here, which it
// finds with dlsym("imitation"). C and C++.
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

enum { kImitatedDevices = 3 };

struct imitated_device {
  int type;  // 33 omega.3, 34 and 36 omega.6 right and left, 104 sigma.7
  unsigned short serial;
  int is_open, is_powered_up, needs_reset, has_error, wrist_is_initialised;
  int force_is_enabled, brakes_are_on, button_is_emulated, button;
  int forgets_force;  // the device takes its force off by itself
  unsigned char watchdog;
  int time_guard_us;
  double force_F_N[3], torque_F_Nm[3], grip_N;  // as commanded
  double rest_F_m[3];                           // where no force leaves it
  double velocity_F_m_s[3], angular_velocity_F_rad_s[3];
  double frame_F[3][3];  // orientation; the identity at reset
};

struct imitated_libdhd {
  struct imitated_device devices[kImitatedDevices];
  int count;
  int is_expert;
  const char* failing;    // name of the call that fails: "dhdSetBrakes"; "*": all
  int result_of_reading;  // 0, or 1: the time guard kept it from being read
  int calls;
  double largest_force_after_failure_N;  // that was commanded while a call failed or since
  int has_failed;
};

#define kImitatedStiffness_N_per_m 500.0

__attribute__((visibility("default"))) struct imitated_libdhd* imitation(void);

#ifdef __cplusplus
}
#endif
