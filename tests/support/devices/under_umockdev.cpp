#include "tests/support/devices/under_umockdev.h"

#include <link.h>
#include <linux/capability.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

namespace farfeel::test_support {
namespace {

constexpr const char* kPreload = "libumockdev-preload.so.0";
constexpr const char* kTried = "FARFEEL_TRIED_UMOCKDEV";

// The path of a loaded library whose name holds this; empty: none.
std::string loaded_library(const char* name) {
  struct Search {
    const char* name;
    std::string path;
  } search{name, {}};
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* to) {
        auto& found = *static_cast<Search*>(to);
        if (std::strstr(info->dlpi_name, found.name) == nullptr) return 0;
        found.path = info->dlpi_name;
        return 1;
      },
      &search);
  return search.path;
}

bool is_preloaded() {
  return !loaded_library(kPreload).empty();
}

}  // namespace

void enter_umockdev(char** argv) {
  if (is_preloaded() || std::getenv(kTried) != nullptr) return;
  // A sanitizer's library must come before any other.
  std::string preload;
  for (const char* sanitizer : {"libasan", "libtsan"}) {
    if (const std::string path = loaded_library(sanitizer); !path.empty()) preload += path + ":";
  }
  setenv("LD_PRELOAD", (preload + kPreload).c_str(), 1);
  setenv(kTried, "1", 1);
  execv("/proc/self/exe", argv);
}

std::string why_not_under_umockdev() {
#if defined(__SANITIZE_THREAD__)
  return "GLib's threads are not instrumented, and the thread sanitizer takes them for races";
#else
  if (is_preloaded()) return {};
  return std::string(kPreload) + " cannot be preloaded here (Debian package umockdev)";
#endif
}

void respect_permissions() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct data[_LINUX_CAPABILITY_U32S_3] = {};
  if (syscall(SYS_capget, &header, data) != 0) return;
  constexpr std::uint32_t kOverrides = 1U << CAP_DAC_OVERRIDE | 1U << CAP_DAC_READ_SEARCH;
  data[0].effective &= ~kOverrides;
  data[0].permitted &= ~kOverrides;  // access() goes by these where the real user is root
  syscall(SYS_capset, &header, data);
}

}  // namespace farfeel::test_support
