/* What this plug-in calls of Force Dimension's library libdhd, which is theirs and not part of Farfeel: the user
 * installs it, and it is loaded when the plug-in is. The declarations below are facts of its public interface (SDK 3.7:
 * names, arguments, results); nothing of its files is here.
 *
 * Results below 0 are errors, explained by ErrorGetLastStr. kDhdTimeGuard and kDhdMotorSaturated are no errors. */
#ifndef FARFEEL_LIBDHD_H
#define FARFEEL_LIBDHD_H

#include <stddef.h>

enum { kDhdTimeGuard = 1, kDhdMotorSaturated = 2 };
/* Of GetStatus. The library writes 16 numbers; there is room for what later versions add. */
enum { kDhdStatusPower = 0, kDhdStatusReset = 3, kDhdStatusForce = 5, kDhdStatusError = 9, kDhdStatusWristInit = 12 };
enum { kDhdStatusForceOffCause = 14, kDhdStatuses = 32 };

struct libdhd {
  int (*GetDeviceCount)(void);
  int (*OpenID)(char index); /* the device's ID, or below 0 */
  int (*Close)(char id);
  int (*GetSerialNumber)(unsigned short* serial, char id);
  int (*GetSystemType)(char id);
  int (*GetStatus)(int status[kDhdStatuses], char id);
  int (*EnableForce)(unsigned char is_on, char id);
  int (*SetBrakes)(int is_on, char id); /* on: motors are shorted, and the hand is braked, not pushed */
  int (*GetButton)(int index, char id);
  int (*GetPositionAndOrientationFrame)(double* x_m, double* y_m, double* z_m, double frame[3][3], char id);
  int (*GetLinearVelocity)(double* x_m_s, double* y_m_s, double* z_m_s, char id);
  int (*GetAngularVelocityRad)(double* x_rad_s, double* y_rad_s, double* z_rad_s, char id);
  int (*SetForceAndTorqueAndGripperForce)(double fx_N, double fy_N, double fz_N, double tx_Nm, double ty_Nm,
                                          double tz_Nm, double grip_N, char id);
  const char* (*ErrorGetLastStr)(void);
  /* Null where a version of the library lacks them. */
  int (*EmulateButton)(unsigned char is_on, char id); /* a closed gripper is button 0 */
  int (*EnableExpertMode)(void);
  int (*DisableExpertMode)(void);
  int (*SetTimeGuard)(int least_us, char id);              /* in expert mode */
  int (*SetWatchdog)(unsigned char times_125_us, char id); /* likewise, since 3.3.2: force goes off by itself */
};

/* Loads $FARFEEL_DHD_LIBRARY, or else libdhd as the system finds it, once for each name. Null: `why` says why not. */
const struct libdhd* libdhd_loaded(char* why, size_t why_size);

#endif
