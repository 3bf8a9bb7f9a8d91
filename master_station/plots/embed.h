// Files that the build puts into a program: FARFEEL_EMBED(name, "path") at namespace scope, then embedded(name_begin,
// name_end).
#pragma once

#include <string_view>

#define FARFEEL_EMBED(name, file)                                                                        \
  asm(".section .rodata\n" #name "_begin:\n.incbin \"" file "\"\n" #name "_end:\n.byte 0\n.previous\n"); \
  extern "C" const char name##_begin[], name##_end[];

namespace farfeel::master_station {

[[nodiscard]] inline std::string_view embedded(const char* begin, const char* end) {
  return {begin, static_cast<std::size_t>(end - begin)};
}

}  // namespace farfeel::master_station
