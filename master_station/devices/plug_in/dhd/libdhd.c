#include "libdhd.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct {
  const char* name;
  size_t at;
  int is_needed;
} symbols[] = {
#define NEEDED(name) \
  { "dhd" #name, offsetof(struct libdhd, name), 1 }
#define WELCOME(name) \
  { "dhd" #name, offsetof(struct libdhd, name), 0 }
    NEEDED(GetDeviceCount),
    NEEDED(OpenID),
    NEEDED(Close),
    NEEDED(GetSerialNumber),
    NEEDED(GetSystemType),
    NEEDED(GetStatus),
    NEEDED(EnableForce),
    NEEDED(SetBrakes),
    NEEDED(GetButton),
    NEEDED(GetPositionAndOrientationFrame),
    NEEDED(GetLinearVelocity),
    NEEDED(GetAngularVelocityRad),
    NEEDED(SetForceAndTorqueAndGripperForce),
    NEEDED(ErrorGetLastStr),
    WELCOME(EmulateButton),
    WELCOME(EnableExpertMode),
    WELCOME(DisableExpertMode),
    WELCOME(SetTimeGuard),
    WELCOME(SetWatchdog)};

static int take_symbols(void* library, struct libdhd* to, const char* path, char* why, size_t why_size) {
  size_t i;
  for (i = 0; i < sizeof symbols / sizeof symbols[0]; ++i) {
    /* C has no conversion from an object's address to a function's; POSIX says that they have one form. */
    void* const address = dlsym(library, symbols[i].name);
    memcpy((char*)to + symbols[i].at, &address, sizeof address);
    if (address == NULL && symbols[i].is_needed) {
      snprintf(why, why_size, "%s has no %s: install version 3.7 or later of Force Dimension's SDK", path,
               symbols[i].name);
      return 0;
    }
  }
  return 1;
}

const struct libdhd* libdhd_loaded(char* why, size_t why_size) {
  static struct libdhd functions;
  static char loaded[512];
  const char* const wanted = getenv("FARFEEL_DHD_LIBRARY");
  const char* const names[] = {"libdhd.so", "libdhd.so.3", "libdrd.so", "libdrd.so.3"}; /* libdrd holds libdhd's, too */
  const char* path = wanted != NULL && wanted[0] != '\0' ? wanted : NULL;
  void* library = NULL;
  size_t i;
  if (path != NULL && strcmp(path, loaded) == 0) return &functions;
  if (path == NULL && loaded[0] != '\0' && strchr(loaded, '/') == NULL) return &functions;
  if (path != NULL) {
    library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  } else {
    for (i = 0; i < sizeof names / sizeof names[0] && library == NULL; ++i) {
      path = names[i];
      library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    }
  }
  if (library == NULL) {
    const char* const error = dlerror();
    snprintf(why, why_size,
             "Force Dimension's library libdhd cannot be loaded (%.100s): install their SDK, or set "
             "FARFEEL_DHD_LIBRARY to its file",
             error != NULL ? error : "no reason");
    return NULL;
  }
  loaded[0] = '\0';
  if (!take_symbols(library, &functions, path, why, why_size)) return NULL;
  if (strlen(path) < sizeof loaded) strcpy(loaded, path);
  return &functions;
}
