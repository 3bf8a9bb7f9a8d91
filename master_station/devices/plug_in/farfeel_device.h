/* How a haptic device that Farfeel does not know is made known to it: a shared library with one entry, plain C99.
 *
 *     cc -std=c99 -shared -fPIC -o my_device.so my_device.c
 *     cp my_device.so ~/.config/farfeel/plug-ins/
 *
 * The library exports farfeel_device_v1(), which returns a table of functions. The folder example/ has a whole one.
 *
 * Units are SI: m, rad, s, N, Nm, kg. Times in _ns are of CLOCK_MONOTONIC. Frame B is the device's base: right-handed,
 * x to the person's right, y away from the person, z up. D is the handle; its origin is the point that the person
 * holds. Angular comes before linear.
 *
 * Memory. Every struct here belongs to the caller, Farfeel, and is valid during the call only. It comes zeroed, but for
 * struct_size. Strings are arrays inside structs: UTF-8, ended by a zero. The plug-in owns its farfeel_device from
 * open() to close(). Nobody frees what the other made.
 *
 * Growth. A later version of this header may add members at the end of a struct. The caller sets struct_size to the
 * size that it knows. A plug-in writes no member that lies beyond struct_size: where a member came later than the
 * struct's first version, it looks first. The table's own struct_size says which functions the plug-in has. A change
 * that is not an addition gets another entry, farfeel_device_v2.
 *
 * Threads. All calls on one device come from one thread, the same from open() to close(). The plug-in may have threads
 * of its own. It runs in the process farfeel-device, apart from the haptic loop: if it crashes or hangs, that process
 * is ended, and force is taken off as zero_force() says. It must not exit, fork, change signal handlers, write to
 * standard output or let a C++ exception out of a call.
 *
 * Farfeel checks all that it is told: what is not finite, out of range or not ended by a zero is a fault, and force
 * stays off until the device is opened again. It caps force and torque at what describe() says before step() gets them.
 */
#ifndef FARFEEL_DEVICE_H
#define FARFEEL_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FARFEEL_DEVICE_ABI 1u
#define FARFEEL_DEVICE_ENTRY "farfeel_device_v1"
#if defined(__GNUC__)
#define FARFEEL_DEVICE_EXPORT __attribute__((visibility("default")))
#else
#define FARFEEL_DEVICE_EXPORT
#endif

/** What find() and open() return. */
enum { FARFEEL_DEVICE_OK = 0, FARFEEL_DEVICE_END = 1, FARFEEL_DEVICE_FAILED = -1 };

/** What step() returns. */
enum {
  FARFEEL_DEVICE_ABSENT = 0,   /**< gone for good: unplugged. It will be closed */
  FARFEEL_DEVICE_OPENING = 1,  /**< set-up is under way */
  FARFEEL_DEVICE_FIRMWARE = 2, /**< firmware is being loaded */
  FARFEEL_DEVICE_HOMING = 3,   /**< it waits to be moved until it knows where it is; advice() says how */
  FARFEEL_DEVICE_READY = 4,    /**< readings are good, a command is obeyed */
  FARFEEL_DEVICE_FAULT = 7     /**< it does not answer, or answers wrong; force is zero. It may come back by itself */
};

/** Of farfeel_device_description.tells. */
enum { FARFEEL_DEVICE_TELLS_POSE = 0, FARFEEL_DEVICE_TELLS_RATE = 1 };

/** A device that is plugged in, opened or not. */
typedef struct farfeel_device_found {
  uint32_t struct_size;
  char model[64];    /**< a to z, 0 to 9 and -, not empty: "my-device" */
  char serial[64];   /**< empty: it tells none */
  char id[64];       /**< by which open() knows it again: printable ASCII without # and spaces, not empty */
  char trouble[256]; /**< empty: it can be opened; else why not, and what to do */
} farfeel_device_found;

/** What the device can do. Zero where it lacks something. What is not known: the best guess, named in `estimated`. */
typedef struct farfeel_device_description {
  uint32_t struct_size;
  char title[64];        /**< "My Company's Device 6" */
  char estimated[512];   /**< names of the members below that are guessed or not published, with commas between them */
  int32_t tells;         /**< where it is (pose), or how far it is pushed (rate) */
  int32_t position_dof;  /**< 0 to 3, measured */
  int32_t rotation_dof;  /**< 0 to 3, measured */
  int32_t force_dof;     /**< 0 to 3, actuated; 0: it gets no force */
  int32_t torque_dof;    /**< 0 to 3, actuated; 0: it gets no torque */
  int32_t is_in_newtons; /**< 0: force is a share of the greatest, until somebody calibrates it */
  int32_t enable_button; /**< force is on while this button is held; -1: there is none */
  int32_t clutch_button; /**< -1: there is none */
  double workspace_min_B_m[3], workspace_max_B_m[3];
  double position_step_m, rotation_step_rad; /**< resolution; > 0 where the degrees of freedom are */
  double rate_Hz;                            /**< how often step() has something new; 1 to 20000 */
  double sensor_delay_s, actuator_delay_s;   /**< 0 to 1 */
  double holds_force_s; /**< how long the device goes on with the last force when nobody speaks to it; infinity: for
                           ever */
  double mass_kg, inertia_kg_m2; /**< felt at the handle; > 0 where it gets force, torque */
  double viscous_friction_Ns_per_m, coulomb_friction_N;
  double viscous_friction_Nms_per_rad, coulomb_friction_Nm;
  double max_force_N, continuous_force_N, max_torque_Nm, continuous_torque_Nm;
  double thermal_time_s;                      /**< in which the square of the force may be averaged; 0: not known */
  double full_speed_m_s, full_rotation_rad_s; /**< of a rate input at full deflection */
} farfeel_device_description;

/** What the handle is to do until the next command. */
typedef struct farfeel_device_command {
  uint32_t struct_size;
  int32_t is_force_on; /**< 0: no force, whatever stands below (zeros do). From 0 to 1 on: enable motors if need be */
  double torque_B_Nm[3], force_B_N[3]; /**< on the hand, about D's origin, in B. Finite, capped */
  int32_t is_light_on;
} farfeel_device_command;

/** The newest that is known of the device. What it does not measure stays zero; `orientation` is then 1, 0, 0, 0. */
typedef struct farfeel_device_sample {
  uint32_t struct_size;
  uint32_t buttons;      /**< bit i: button i is down */
  int64_t time_ns;       /**< when the newest report came; 0: none yet. Never in the future, never back */
  int64_t seen_ns;       /**< when the device last answered, whether it had anything to tell or not */
  uint64_t reports;      /**< since it was opened. Never back */
  double orientation[4]; /**< of D in B: w, x, y, z, unit length within 1e-3. Comes as 1, 0, 0, 0 */
  double position_m[3];  /**< of D's origin in B; at most 10 m from B's origin in any axis */
  double angular_velocity_rad_s[3];
  double velocity_m_s[3];  /**< of D's origin */
  double turn[3], push[3]; /**< of a rate input: deflection about and along x, y, z, -1 to 1 */
  int32_t has_velocity;    /**< 0: Farfeel estimates both velocities from the poses */
} farfeel_device_sample;

/** How to take force off with one system call on a descriptor, when this process is gone. */
typedef struct farfeel_device_zero_force {
  uint32_t struct_size;
  int32_t fd;          /**< open; Farfeel duplicates it and keeps the duplicate */
  int32_t is_usb_bulk; /**< 0: write(fd, bytes, size). 1: USBDEVFS_BULK of the bytes to `endpoint` */
  uint32_t endpoint;   /**< of USBDEVFS_BULK: an out endpoint, 1 to 15 */
  uint32_t size;       /**< 1 to 128 */
  unsigned char bytes[128];
} farfeel_device_zero_force;

typedef struct farfeel_device farfeel_device; /**< the plug-in's own */

typedef struct farfeel_device_plug_in {
  uint32_t struct_size; /**< of this table, as the plug-in was compiled */
  uint32_t abi;         /**< FARFEEL_DEVICE_ABI */
  const char* name;     /**< of the plug-in, for messages, at most 63 bytes; lives as long as the library */

  /** The index-th device, counted from 0; END: there are no more. At most 1 s a call. May open nothing for long. */
  int32_t (*find)(uint32_t index, farfeel_device_found* found);
  /** Opens what find() found, without force. FAILED: `error` says what was tried, what was wrong and what to do. At
   * most 2 s: what takes longer is done in step(), which returns OPENING meanwhile. */
  int32_t (*open)(const farfeel_device_found* found, farfeel_device** device, char* error, size_t error_size);
  /** After open(), once. At most 1 ms. FAILED ends the opening. */
  int32_t (*describe)(farfeel_device* device, farfeel_device_description* description);
  /** Takes over what the device sent, gives it the command, goes on with set-up and homing. It may wait for the device
   * until deadline_ns, and returns as soon as it has something new. It should not allocate once it returned READY. */
  int32_t (*step)(farfeel_device* device, int64_t deadline_ns, const farfeel_device_command* command,
                  farfeel_device_sample* sample);
  /** One sentence for a person: what the stage waits for, what was wrong, what to do. Empty in READY. At most 1 ms. */
  void (*advice)(farfeel_device* device, char* text, size_t text_size);
  /** Takes force off where the device can still be reached, and frees all of it. At most 1 s. */
  void (*close)(farfeel_device* device);
  /** May be null: force cannot be taken off from outside, or there is none. After open(), once. FAILED: likewise. */
  int32_t (*zero_force)(farfeel_device* device, farfeel_device_zero_force* how);
} farfeel_device_plug_in;

/** The one symbol that a plug-in exports. The table lives as long as the library, which is never unloaded. */
FARFEEL_DEVICE_EXPORT const farfeel_device_plug_in* farfeel_device_v1(void);

#ifdef __cplusplus
}
#endif

#endif
