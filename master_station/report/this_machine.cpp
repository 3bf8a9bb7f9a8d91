#include "master_station/report/this_machine.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <pwd.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <array>
#include <ctime>
#include <fstream>
#include <string_view>
#include <thread>

namespace farfeel::master_station {
namespace {

// The value of the first line "key<separator>value" of a file, unquoted; empty when there is none.
std::string first_value(const char* path, std::string_view key, char separator) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with(key)) continue;
    const auto at = line.find(separator);
    if (at == std::string::npos) continue;
    const auto first = line.find_first_not_of(" \t\"", at + 1);
    const auto last = line.find_last_not_of(" \t\"");
    if (first != std::string::npos && first <= last) return line.substr(first, last - first + 1);
  }
  return {};
}

std::string user_name() {
  std::array<char, 4096> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwuid_r(getuid(), &entry, buffer.data(), buffer.size(), &found) == 0 && found) return found->pw_name;
  return fmt::format("uid {}", getuid());
}

bool is_plain(std::string_view argument) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%";
  return !argument.empty() && argument.find_first_not_of(kPlain) == std::string_view::npos;
}

}  // namespace

Machine this_machine(std::string command) {
  Machine m;
  utsname system{};
  if (uname(&system) == 0) {
    m.host = system.nodename;
    m.kernel = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
  }
  m.user = user_name();
  m.cpu = first_value("/proc/cpuinfo", "model name", ':');
  m.cores = static_cast<int>(std::thread::hardware_concurrency());
  m.memory_GiB =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE)) / 1073741824.0;
  m.os = first_value("/etc/os-release", "PRETTY_NAME", '=');
#if defined(__clang__)
  m.compiler = "clang " __clang_version__;
#else
  m.compiler = "g++ " __VERSION__;
#endif
  m.started_utc = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  m.command = std::move(command);
  return m;
}

std::string command_line(int argc, const char* const* argv) {
  std::string line;
  for (int i = 0; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (i > 0) line += ' ';
    if (is_plain(argument)) {
      line += argument;
      continue;
    }
    line += '\'';
    for (const char c : argument) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += '\'';
  }
  return line;
}

}  // namespace farfeel::master_station
