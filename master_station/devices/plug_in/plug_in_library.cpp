#include "master_station/devices/plug_in/plug_in_library.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>

namespace farfeel::devices {
namespace {

constexpr int kNewestVersionToLookFor = 9;
constexpr std::size_t kMaxName = 63;
// The functions of the table's first version.
constexpr std::size_t kTableSize =
    offsetof(farfeel_device_plug_in, zero_force) + sizeof(farfeel_device_plug_in{}.zero_force);

tl::unexpected<DeviceError> refusal(const std::string& path, const std::string& why) {
  return tl::unexpected(DeviceError{"the plug-in " + path + " was not loaded: " + why});
}

/// Why somebody else could have written what the path leads to; nothing: nobody could.
std::optional<std::string> foreign_hands(const std::string& path) {
  struct stat is {};
  if (stat(path.c_str(), &is) != 0) return path + ": " + std::strerror(errno);
  if (is.st_uid != geteuid() && is.st_uid != 0)
    return fmt::format("{} belongs to user {}, and only what this user or root owns is run here", path, is.st_uid);
  // In a folder such as /tmp with the sticky bit, nobody can replace what another owns.
  if ((is.st_mode & (S_IWGRP | S_IWOTH)) != 0 && !(S_ISDIR(is.st_mode) && (is.st_mode & S_ISVTX) != 0))
    return fmt::format("others may write to {}: take that away with  chmod go-w {}", path, path);
  return std::nullopt;
}

std::optional<std::string> lack_of(const farfeel_device_plug_in* table) {
  if (table == nullptr) return FARFEEL_DEVICE_ENTRY "() returned nothing";
  if (table->struct_size < kTableSize)
    return fmt::format("its table has {} bytes where version 1 has {}: compile it against farfeel_device.h",
                       table->struct_size, kTableSize);
  if (table->abi != FARFEEL_DEVICE_ABI)
    return fmt::format("its table is of version {}, and this program knows version {}", table->abi, FARFEEL_DEVICE_ABI);
  const std::pair<bool, const char*> needed[] = {
      {table->name != nullptr, "name"},    {table->find != nullptr, "find()"},
      {table->open != nullptr, "open()"},  {table->describe != nullptr, "describe()"},
      {table->step != nullptr, "step()"},  {table->advice != nullptr, "advice()"},
      {table->close != nullptr, "close()"}};
  for (const auto& [is_there, what] : needed)
    if (!is_there) return fmt::format("its table lacks {}", what);
  return std::nullopt;
}

}  // namespace

tl::expected<PlugInLibrary, DeviceError> load_plug_in(const std::string& path) {
  const std::unique_ptr<char, decltype(&std::free)> resolved(realpath(path.c_str(), nullptr), &std::free);
  if (!resolved)
    return refusal(path, errno == ENOENT ? "there is no such file; name the library's file, or copy it there"
                                         : std::strerror(errno));
  PlugInLibrary library{.path = resolved.get(), .name = {}, .table = nullptr};
  if (const auto why = foreign_hands(library.path)) return refusal(path, *why);
  if (const auto why = foreign_hands(std::filesystem::path(library.path).parent_path())) return refusal(path, *why);

  void* const handle = dlopen(library.path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (handle == nullptr) {
    const char* const why = dlerror();
    return refusal(path, fmt::format("it is no shared library that can be loaded here ({})", why ? why : "no reason"));
  }
  void* const entry = dlsym(handle, FARFEEL_DEVICE_ENTRY);
  if (entry == nullptr) {
    for (int version = 2; version <= kNewestVersionToLookFor; ++version)
      if (dlsym(handle, fmt::format("farfeel_device_v{}", version).c_str()) != nullptr)
        return refusal(path,
                       fmt::format("it is made for version {} of farfeel_device.h, and this program knows version "
                                   "1: use a newer Farfeel, or compile the plug-in against this one's header",
                                   version));
    return refusal(path, "it is a library, but no plug-in of Farfeel: it exports no " FARFEEL_DEVICE_ENTRY);
  }
  // POSIX says that what dlsym returns of a function may be called.
  const auto get = reinterpret_cast<decltype(&farfeel_device_v1)>(entry);
  library.table = get();
  if (const auto why = lack_of(library.table)) return refusal(path, *why);
  const std::size_t length = strnlen(library.table->name, kMaxName + 1);
  if (length == 0 || length > kMaxName) return refusal(path, "its name is empty or longer than 63 bytes");
  library.name.assign(library.table->name, length);
  return library;
}

std::vector<std::string> installed_plug_ins() {
  const auto environment = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value != nullptr ? value : "");
  };
  std::string above = environment("XDG_CONFIG_HOME");
  if (above.empty() && !environment("HOME").empty()) above = environment("HOME") + "/.config";
  std::vector<std::string> paths;
  if (above.empty()) return paths;
  std::error_code lack;
  std::filesystem::directory_iterator entries(above + "/farfeel/plug-ins", lack), end;
  for (; !lack && entries != end; entries.increment(lack))
    if (entries->path().extension() == ".so") paths.push_back(entries->path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace farfeel::devices
