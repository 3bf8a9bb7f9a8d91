#include "master_station/devices/channel/usb_listing.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <memory>
#include <optional>

namespace farfeel::devices {

namespace {

constexpr const char* kSysfs = "/sys/bus/usb/devices";

struct CloseFolder {
  void operator()(DIR* folder) const { ::closedir(folder); }
};

/// Names in a folder but those that begin with a dot; none where it cannot be read.
std::vector<std::string> names_in(const std::string& path) {
  std::vector<std::string> names;
  const std::unique_ptr<DIR, CloseFolder> folder(::opendir(path.c_str()));
  if (!folder) return names;
  while (const dirent* entry = ::readdir(folder.get()))
    if (entry->d_name[0] != '.') names.emplace_back(entry->d_name);
  std::ranges::sort(names);
  return names;
}

/// The first line of a small file, what is not printable left out.
std::string line_of(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return {};
  std::array<char, 256> text{};
  const ssize_t size = ::read(fd, text.data(), text.size());
  ::close(fd);
  std::string line;
  for (ssize_t i = 0; i < size && text[static_cast<std::size_t>(i)] != '\n'; ++i) {
    const char c = text[static_cast<std::size_t>(i)];
    if (c >= ' ' && c <= '~') line.push_back(c);
  }
  return line;
}

std::optional<unsigned> number_of(const std::string& path, int base) {
  const std::string line = line_of(path);
  unsigned value = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value, base);
  if (error != std::errc{} || line.empty()) return std::nullopt;
  return value;
}

std::string target_of(const std::string& link) {
  std::array<char, 512> text{};
  const ssize_t size = ::readlink(link.c_str(), text.data(), text.size());
  return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : std::string();
}

std::string trouble_of(const FoundUsb& found, std::span<const std::string_view> gives_way) {
  if (::access(found.path.c_str(), F_OK) != 0) return fmt::format("{} is not there: is udev running?", found.path);
  if (::access(found.path.c_str(), R_OK | W_OK) != 0)
    return fmt::format(
        "no permission for {}: install deploy/udev/70-farfeel.rules in /etc/udev/rules.d, then plug the device in "
        "again",
        found.path);
  if (found.driver == "usbfs") {  // some program claimed it
    const std::string user = other_user_of(found.path);
    if (!user.empty()) return fmt::format("busy: {} uses it; end that program", user);
  } else if (!found.driver.empty() && std::ranges::find(gives_way, found.driver) == gives_way.end()) {
    return fmt::format("the kernel's driver {0} holds it: echo {1}:1.0 | sudo tee /sys/bus/usb/drivers/{0}/unbind",
                       found.driver, found.port);
  }
  return {};
}

}  // namespace

std::vector<FoundUsb> find_usb_devices(std::span<const UsbId> ids, std::span<const std::string_view> gives_way) {
  std::vector<FoundUsb> all;
  for (const std::string& port : names_in(kSysfs)) {
    if (port.find(':') != std::string::npos) continue;  // an interface
    const std::string folder = fmt::format("{}/{}/", kSysfs, port);
    const auto vendor = number_of(folder + "idVendor", 16), product = number_of(folder + "idProduct", 16);
    if (!vendor || !product) continue;
    const auto is_it = [&](const UsbId& id) { return id.vendor == *vendor && id.product == *product; };
    const auto id = std::ranges::find_if(ids, is_it);
    if (id == ids.end()) continue;
    const auto bus = number_of(folder + "busnum", 10), address = number_of(folder + "devnum", 10);
    if (!bus || !address) continue;  // it is just going
    FoundUsb found{.id = *id,
                   .serial = line_of(folder + "serial"),
                   .port = port,
                   .path = fmt::format("/dev/bus/usb/{:03}/{:03}", *bus, *address),
                   .driver = target_of(fmt::format("{}{}:1.0/driver", folder, port)),
                   .trouble = {}};
    found.driver.erase(0, found.driver.rfind('/') + 1);
    found.trouble = trouble_of(found, gives_way);
    all.push_back(std::move(found));
  }
  return all;
}

std::string other_user_of(const std::string& path) {
  const std::string self = std::to_string(::getpid());
  for (const std::string& process : names_in("/proc")) {
    if (process.find_first_not_of("0123456789") != std::string::npos || process == self) continue;
    const std::string folder = "/proc/" + process;
    for (const std::string& fd : names_in(folder + "/fd"))
      if (target_of(folder + "/fd/" + fd) == path) return fmt::format("{} ({})", line_of(folder + "/comm"), process);
  }
  return {};
}

}  // namespace farfeel::devices
