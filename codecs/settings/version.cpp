#include "codecs/settings/version.h"

#include <farfeel_commit.h>
#include <fmt/format.h>
#include <sys/utsname.h>

namespace farfeel::codecs {
namespace {

constexpr const char* kCompiler =
#if defined(__clang__)
    "clang " __clang_version__;
#else
    "g++ " __VERSION__;
#endif

std::string_view instruction_set() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") != 0) return "x86-64 with AVX-512";
  if (__builtin_cpu_supports("avx2") != 0) return "x86-64 with AVX2";
  return "x86-64 without AVX2: penetration depths take longer";
#else
  return "not x86-64: penetration depths take longer";
#endif
}

}  // namespace

std::string version_text(std::string_view program) {
  utsname system{};
  const bool is_known = ::uname(&system) == 0;
  return fmt::format("{} {} ({}, {}, {})\nkernel: {}\ninstruction set: {}", program, FARFEEL_VERSION, FARFEEL_COMMIT,
                     FARFEEL_BUILD_TYPE, kCompiler,
                     is_known ? fmt::format("{} {} {}", system.sysname, system.release, system.machine) : "unknown",
                     instruction_set());
}

}  // namespace farfeel::codecs
