/* A plug-in of a version that is not there yet. */
const void* farfeel_device_v2(void);
__attribute__((visibility("default"))) const void* farfeel_device_v2(void) {
  return 0;
}
